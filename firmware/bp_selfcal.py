# bp_selfcal.py: the power-up self-calibration. Known currents run through the offset coils, and the bridges say what
# they make of them (thesis 6.2).
#
# Each point gives the field h of the three dies, SET and RESET undone each in its own state; then, by least squares,
#     h_i = c_i + sum_j G_ij u_j                                                                          (1)
# with u the coil currents in units of the trajectory. What this can know, and what it cannot:
#   gain      G_ii over the factory's G_ii. A difference of readings: ambient field and bias drop out. It is the product
#             of bridge, amplifier, converter and coil driver; of these the coil itself is taken as constant.
#   ambient   c_i holds the ambient field and any change of the bias since the factory (magnetic or left over from
#             demodulation). Unshielded, nothing in the run separates the two: the factory bias stays in force and c is
#             reported only. Shielded, the ambient is zero and c is the change of bias (the B_c of eq. 6.7).
#   offset    the bridge's and amplifier's own offset (thesis 3.4), shielded or not: with the right one SET and RESET
#             give the same field. Demodulation removes it to first order; the cross field sees it once more.
#   axes      nothing is learnt of the angles between the axes: each coil sits on its own die and turns with it.
# Points come as pairs +u, -u and in blocks in which every axis sees the same mean square. The mean of h over a block
# is therefore c, whatever the gains and whatever even term the model lacks, and a step of c between blocks is a step of
# the ambient field.
import math
import struct
import time

from micropython import const

import bp_compensate
import bp_reasons as reasons
from bp_givens import Givens
from bp_points import Points

_HUGE = 1e30
_LOOKS = const(3)  # at the first block, before the whole run


class Solution:
    def __init__(self, gain, response, ambient_ut, residual_ut, step_ut, offset_lsb):
        self.gain = gain  # over the factory gain, three
        self.response_ut = response  # (1), uT per unit as the factory calibration reads it: three rows of three
        self.ambient_ut = ambient_ut  # c of (1)
        self.residual_ut = residual_ut  # rms by axis
        self.step_ut = step_ut  # largest change of c between blocks
        self.offset_lsb = offset_lsb  # electronic offset beyond the model's


def measure(points, sampler, coils, compensator, trajectory, board):  # fills points; coils at zero on every way out
    try:
        for index in range(trajectory.POINTS):
            codes = struct.unpack_from("<HHH", trajectory.CODES, 6 * index)
            coils.set(codes)
            _average(sampler, board)
            unit = [coils.current_ma(i, codes[i]) / trajectory.UNIT_MA[i] for i in range(3)]
            means = bp_compensate.means_lsb(sampler)
            points.put(unit, means, compensator.coil_ma(sampler), compensator.temp_c(sampler))
    finally:
        coils.zero()


def _average(sampler, board):
    sampler.fresh()
    for _ in range(board.SETTLE_CYCLES):
        sampler.cycle()
    sampler.clear()
    for _ in range(board.CYCLES_PER_POINT):
        sampler.cycle()
    sampler.check()


def solve(points, calibration, trajectory, gain_limit):
    # The law of the bridge is curved, so the gain and the offset at which it is read matter a little: looks at the
    # first block settle both, each at least twenty times better than the last, and then the whole run is read.
    block = trajectory.BLOCK or points.count
    gain, offset = [1.0, 1.0, 1.0], list(calibration.FACTORY_OFFSET_LSB)
    for _ in range(_LOOKS):
        look = _Fit(points, block, gain, offset, calibration)
        gain, offset = look.better_gain(gain), look.better_offset(gain, offset)
        if max([abs(g - 1.0) for g in gain]) > gain_limit:
            gain = [1.0, 1.0, 1.0]
    fit = _Fit(points, points.count, gain, offset, calibration, trajectory.BLOCK)
    response = [[gain[i] * g for g in fit.response[i]] for i in range(3)]
    return Solution(
        fit.better_gain(gain),
        response,
        fit.ambient_ut,
        fit.residual_ut,
        fit.step_ut(),
        fit.better_offset(gain, offset),
    )


class _Fit:  # equation (1) over the first points, read at this gain and offset
    def __init__(self, points, count, gain, offset, calibration, block=0):
        self._calibration = calibration
        self._block_means = []
        self._apart_ut = [0.0, 0.0, 0.0]  # half of what SET and RESET differ by
        givens = Givens(4, 3)
        for index in range(count):
            point = points.get(index)
            field = self._field(point, gain, offset, count)
            for i in range(3):
                givens.row[1 + i] = point[1 + i]
                givens.row[4 + i] = field[i]
            givens.row[0] = 1.0
            givens.add()
            if block:
                self._note_block(index, field, block)
        solved = [givens.solve(k) for k in range(3)]
        self.ambient_ut = [x[0] for x in solved]
        self.response = [x[1:] for x in solved]
        self.residual_ut = [math.sqrt(rss / max(givens.n - 4, 1)) for rss in givens.rss]

    def _field(self, point, gain, offset, count):
        factory = self._calibration.FACTORY_GAIN_UT_PER_UNIT
        after_set = [point[4 + i] - offset[i] for i in range(3)]
        after_reset = [offset[i] - point[7 + i] for i in range(3)]
        coil = [factory[i][i] * point[1 + i] for i in range(3)]
        fields = self._calibration.undo_coil(*after_set, *after_reset, point[13], *gain, *coil)
        for i in range(3):
            self._apart_ut[i] += 0.5 * (fields[i] - fields[3 + i]) / count
        return [0.5 * (fields[i] + fields[3 + i]) for i in range(3)]

    def _note_block(self, index, field, block):
        if index % block == 0:
            self._block_means.append([0.0, 0.0, 0.0])
        mean = self._block_means[-1]
        for i in range(3):
            mean[i] += field[i] / block

    def better_gain(self, gain):
        factory = self._calibration.FACTORY_GAIN_UT_PER_UNIT
        return [gain[i] * self.response[i][i] / factory[i][i] for i in range(3)]

    def better_offset(self, gain, offset):
        slope = self._calibration.SLOPE_LSB_PER_UT
        return [offset[i] + slope[i] * gain[i] * self._apart_ut[i] for i in range(3)]

    def step_ut(self):
        means = self._block_means
        return max([max([m[i] for m in means]) - min([m[i] for m in means]) for i in range(3)]) if means else 0.0


def in_numbers(solution):  # nan and inf, where float32 ran over, are below no bound: judge() would let nan pass
    found = solution.gain + solution.ambient_ut + solution.residual_ut + solution.offset_lsb
    if not sum([abs(value) for value in found]) < _HUGE:
        raise ValueError
    return solution


def current_ratio(points, trajectory):  # current read back over current asked for, by axis
    ratios = []
    for i in range(3):
        product = square = 0.0
        for index in range(points.count):
            point = points.get(index)
            asked_ma = point[1 + i] * trajectory.UNIT_MA[i]
            product += asked_ma * point[10 + i]
            square += asked_ma * asked_ma
        ratios.append(product / square if square else 1.0)
    return ratios


def offset_lsb(points):  # the electronic offset, mean of (SET + RESET) / 2
    total = [0.0, 0.0, 0.0]
    for index in range(points.count):
        point = points.get(index)
        for i in range(3):
            total[i] += 0.5 * (point[4 + i] + point[7 + i]) / points.count
    return total


def judge(solution, ratios, calibration, board):  # codes of all that is wrong, causes before consequences
    found = []
    if any(abs(r - 1.0) > board.CURRENT_TOLERANCE for r in ratios):
        found.append(reasons.COIL_CURRENT)
    if solution.step_ut > board.AMBIENT_STEP_LIMIT_UT:
        found.append(reasons.AMBIENT_STEP)
    if any(abs(g - 1.0) > calibration.GAIN_DRIFT_LIMIT for g in solution.gain):
        found.append(reasons.GAIN_DRIFT)
    if any(r > calibration.RESIDUAL_LIMIT_UT for r in solution.residual_ut):
        found.append(reasons.RESIDUAL)
    return found


class Run:  # a whole self-calibration; `solution` stays None where the hardware gave up
    def __init__(self, points):
        self.reasons = []
        self.detail = ""
        self.points = points
        self.solution: Solution | None = None
        self.offset_lsb = [0.0] * 3
        self.current_ratio = [0.0] * 3
        self.duration_s = 0.0

    @property
    def accepted(self):
        return self.solution is not None and not self.reasons

    def temp_c(self):  # at the end of the run
        return self.points.get(self.points.count - 1)[13]


def run(sampler, coils, compensator, trajectory, calibration, board):
    result = Run(Points(trajectory.POINTS))
    begin_ms = time.ticks_ms()
    try:
        measure(result.points, sampler, coils, compensator, trajectory, board)
        result.solution = in_numbers(solve(result.points, calibration, trajectory, calibration.GAIN_DRIFT_LIMIT))
        result.current_ratio = current_ratio(result.points, trajectory)
        result.offset_lsb = offset_lsb(result.points)
        result.reasons = judge(result.solution, result.current_ratio, calibration, board)
    except reasons.Fault as fault:
        result.reasons = [fault.code]
        result.detail = fault.detail
    except (ValueError, ZeroDivisionError, OverflowError):  # a root of a negative number, a matrix without rank
        result.reasons = [reasons.OUT_OF_RANGE]
    result.duration_s = time.ticks_diff(time.ticks_ms(), begin_ms) / 1000
    return result
