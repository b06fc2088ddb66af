# bp_fast.py: a streamed row without an allocation: the sums of a cycle, undone in fixed point (bp_hot, run by bp_fixed)
# and framed in place. A row outside the range for which bp_hot was proved is not made here: the float version makes it.
from array import array

from micropython import const

from bp_frame import HEAD, Frame
from bp_native import fixed

ROW_FORMAT = "<qiiiiiiffffffff"  # what this file can fill: time, six sums, temperature, currents, supply, field
_ROW = const(64)
_SUMS = const(11)  # where they stand in the body, after head and time
_FLOATS = const(35)


class FastRow:
    def __init__(self, hot, samples, kind):  # samples: summed in a half cycle; kind: of the frame
        self._hot = hot
        self._samples = samples
        self._registers = array("i", hot.REGISTERS)
        self._offsets = array("i", bytearray(24))
        self._limits = hot.LOW + hot.HIGH
        self._frame = Frame(kind, _ROW)
        self.ready = False

    def put_in_force(self, compensator):  # today's gains, offsets and shift; not ready where they are out of range
        hot = self._hot
        self.ready = False
        for i in range(6):
            offset_lsb = compensator.offset_lsb[i % 3]
            if not abs(offset_lsb) < hot.MOST_OFFSET_LSB:
                return
            self._offsets[i] = round(offset_lsb * (self._samples << hot.SHIFTS[2 * i]))
        given = tuple(compensator.gain) + (tuple(compensator.shift_ut) if hot.SHIFTED else ())
        if not all(low <= value <= high for value, (low, high) in zip(given, hot.SLOW_BOX)):
            return
        for value, register, per_one in zip(hot.slow(*given), hot.SLOW, hot.SLOW_PER_ONE):
            self._registers[register] = round(value * per_one)
        self.ready = True

    def line(self, sums, limbs, sequence):  # of a row, None where it lies outside; sums: array("i") of 11
        hot, registers, body = self._hot, self._registers, self._frame.body
        if fixed.take(sums, self._offsets, hot.SHIFTS, hot.INPUTS, self._limits, registers):
            return None
        fixed.run(hot.CODE, hot.COUNT, registers)
        fixed.copy(limbs, 8, body, HEAD)
        fixed.copy(sums, 24, body, _SUMS)
        fixed.floats(registers, hot.OUTPUTS, hot.EXPONENTS, 8, body, _FLOATS)
        return self._frame.sealed(sequence)


def fast_row(board, calibration, kind, row_format):  # a FastRow, None where this build or this processor has none
    if fixed is None or calibration.PATH != "viper" or row_format != ROW_FORMAT:
        return None
    try:
        import bp_hot
    except ImportError:
        return None
    return FastRow(bp_hot, board.SAMPLES_PER_HALF, kind) if bp_hot.CALIBRATION == calibration.CALIBRATION else None
