# bp_timed.py: sums of flip cycles that the hardware timers have pulsed and sampled (bp_timers, bp_scan, bp_ring), with
# the interface of bp_sampler.Sampler. cycle() takes the oldest cycle of the ring that has not been read, so a pause of
# the caller costs nothing as long as it is shorter than the ring is deep; what it does cost is counted in `lost`.
# Nothing in cycle() makes a float or allocates.
import time
from array import array

from micropython import const

import bp_reasons as reasons
import bp_timers
from bp_native import sum16
from bp_ring import SLIPPED, Ring
from bp_sampler import BRIDGE, COIL, RESET, SET, SUPPLY
from bp_scan import INPUTS, Scan

_SUMS = const(11)
_TOP = const(4095)  # of the converter; its middle is no signal for all inputs but bridge voltage and supply
_MIDDLE = const(2048)
_ALL_AXES = const(0b111)
_RESTARTS = const(3)  # in a row, without one whole cycle between them
_SLEEP_US = const(200)  # longest sleep at a time while a cycle is awaited


def make(pulses, board):
    plan = bp_timers.plan_for(board, board.RATE_HZ)
    scan = Scan(board.ADC_PINS, board.ADC_CHANNELS, 2 * plan.scans * INPUTS * board.RING_CYCLES)
    return TimedSampler(pulses, scan, plan, board)


class TimedSampler:
    def __init__(self, pulses, scan, plan, board):
        self._pulses = pulses
        self._scan = scan
        self._plan = plan
        self._board = board
        self.samples = board.SAMPLES_PER_HALF
        self._ring = Ring(scan.position)
        self._running = False
        self.sums = array("i", bytearray(4 * _SUMS))
        self._one = array("i", bytearray(4 * _SUMS))  # of the cycle that is being read
        self._found = array("i", bytearray(12))  # sum, smallest and largest
        self.mid_us = 0  # ticks of the last RESET pulse, the middle of the last cycle
        self.cycles = 0
        self.lost = 0  # flip cycles that were overwritten before they were read, or sampled with gaps; never cleared
        self.clipped = 0  # a bit for each axis that reached the end of the converter
        self._moving = 0  # a bit for each axis whose samples differ at all

    def clear(self):
        for i in range(_SUMS):
            self.sums[i] = 0
        self.cycles = self.clipped = self._moving = 0

    def start(self):  # also after stop(); cycle() does it by itself
        self._begin(self._plan)

    def retime(self, rate_hz):  # another flip rate: pulses off, then the new beat from its beginning
        plan = bp_timers.plan_for(self._board, rate_hz)
        if 2 * plan.scans * INPUTS > len(self._scan.ring) or plan.scans < self.samples:
            raise ValueError(f"the ring does not fit a flip rate of {rate_hz:g} Hz")
        self._begin(plan)

    def stop(self):
        self._running = False
        try:
            self._pulses.off()
        finally:
            self._scan.stop()

    def fresh(self):  # what was sampled before now does not count
        if not self._running:
            self.start()
        behind = self._ring.behind()
        if behind == SLIPPED:
            self._restart()
        else:
            self._ring.skip(behind + 1)

    def cycle(self):
        if not self._running:
            self.start()
        for _ in range(_RESTARTS):
            if self._await() and self._read():
                return
            if self._pulses.stopped():
                self.stop()
                raise reasons.Fault(reasons.FLIP_STOPPED)
            self._restart()
        self.stop()
        raise reasons.Fault(reasons.ADC_SILENT)

    def check(self):  # after at least one cycle
        if self.clipped:
            raise reasons.Fault(reasons.SATURATED)
        if self._moving != _ALL_AXES:
            raise reasons.Fault(reasons.ADC_STUCK)

    def _begin(self, plan):
        self.stop()
        self._plan = plan
        self._first = plan.scans - self.samples  # the scans before it are settling
        slots = len(self._scan.ring) // (2 * plan.scans * INPUTS)
        self._pulses.prepare(plan)
        self._scan.start(2 * plan.scans * INPUTS * slots)
        self._ring.start(plan, slots, self._scan.scan_us, self._pulses.start(plan))
        self._running = True

    def _restart(self):  # scans were missed: places in the ring no longer are phases
        self.lost += self._ring.since() + 1
        self._begin(self._plan)

    def _await(self):  # False: scans were missed, or the pulses have stopped
        ring = self._ring
        while True:
            if self._scan.silent() or self._pulses.stopped():
                return False
            behind = ring.behind()
            if behind == SLIPPED:
                return False
            if behind >= ring.slots - 1:  # the writer is, or will soon be, where we would read
                kept = ring.slots // 2
                self.lost += behind - kept
                ring.skip(behind - kept)
            elif behind:
                return True
            else:
                time.sleep_us(max(min(ring.left_us(), _SLEEP_US), 1))

    def _read(self):  # False: it was overwritten meanwhile, or scans were missed
        ring = self._ring
        for i in range(_SUMS):
            self._one[i] = 0
        clipped, moving = self.clipped, self._moving
        first = ring.first() + self._first
        self._half(SET, first)
        self._half(RESET, first + self._plan.scans)
        behind = ring.behind()
        if behind == SLIPPED or self._scan.silent():
            self.clipped, self._moving = clipped, moving
            return False
        if behind >= ring.slots:
            self.clipped, self._moving = clipped, moving
            self.lost += 1
            ring.skip(1)
            return self._await() and self._read()
        for i in range(_SUMS):
            self.sums[i] += self._one[i]
        self.mid_us = ring.mid_us()
        self.cycles += 1
        ring.skip(1)
        return True

    def _half(self, into, first):  # scans `first` and on, `samples` of them
        for axis in range(3):
            self._axis(into + axis, axis, first)
        one, codes = self._one, self._scan.ring
        at = (first + self.samples - 1) * INPUTS  # one of the slow inputs is enough
        one[BRIDGE] += codes[at + 3]
        for axis in range(3):
            one[COIL + axis] += codes[at + 4 + axis] - _MIDDLE
        one[SUPPLY] += codes[at + 7]

    def _axis(self, into, axis, first):
        found = self._found
        at = first * INPUTS + axis
        sum16(self._scan.ring, at, INPUTS, at + self.samples * INPUTS, found)
        low, high = found[1], found[2]
        self._one[into] = found[0] - self.samples * _MIDDLE
        if low == 0 or high == _TOP:
            self.clipped |= 1 << axis
        if low < high:
            self._moving |= 1 << axis
