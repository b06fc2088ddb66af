# bp_sampler.py: one flip cycle after the other, summed. A cycle is SET, settle, read, RESET, settle, read
# (thesis 3.4); the sums of a point run over as many cycles as the caller asks for before the next clear().
# Nothing here makes a float or allocates, so the collector never runs inside a cycle.
import time
from array import array

from micropython import const

import bp_reasons as reasons
from bp_native import sum24

SET = const(0)  # sums[SET + axis]
RESET = const(3)
BRIDGE = const(6)  # bridge voltage, one conversion a half cycle as all that follow
COIL = const(7)  # sums[COIL + axis]
SUPPLY = const(10)
_ALL_AXES = const(0b111)
FRAME_BYTES = const(30)  # what every converter's driver fills: status, eight channels, check sum, 24 bits each


class Sampler:
    def __init__(self, adc, flip, board):
        self._adc = adc
        self._flip = flip
        self._settle_us = board.SETTLE_US
        self._half_us = board.HALF_US
        self.samples = board.SAMPLES_PER_HALF
        self._words = tuple(3 + 3 * channel for channel in board.ADC_CHANNELS)  # first byte of each in a frame
        self._raw = bytearray(FRAME_BYTES * self.samples)
        view = memoryview(self._raw)
        self._frames = tuple(view[at : at + FRAME_BYTES] for at in range(0, len(self._raw), FRAME_BYTES))
        self._old = bytearray(FRAME_BYTES)
        self._found = array("i", bytearray(12))  # sum, smallest and largest
        self._next_us = time.ticks_us()
        self.sums = array("i", bytearray(4 * 11))
        self.mid_us = 0  # ticks of the last RESET pulse, the middle of the last cycle
        self.cycles = 0
        self.lost = 0  # flip cycles that went by without a row; none can here, the next one just comes later
        self.clipped = 0  # a bit for each axis that reached the end of the converter
        self._moving = 0  # a bit for each axis whose samples differ at all

    def clear(self):
        for i in range(11):
            self.sums[i] = 0
        self.cycles = self.clipped = self._moving = 0

    def stop(self):  # nothing runs by itself here
        pass

    def fresh(
        self,
    ):  # what was sampled before this moment does not count: here nothing is sampled before it is asked for
        pass

    def cycle(self):
        self._wait_for_turn()
        self._flip.set()
        self._half(SET)
        self._wait_for_turn()
        self._flip.reset()
        self.mid_us = time.ticks_us()
        self._half(RESET)
        self.cycles += 1

    def check(self):  # after at least one cycle
        if self.clipped:
            raise reasons.Fault(reasons.SATURATED)
        if self._moving != _ALL_AXES:
            raise reasons.Fault(reasons.ADC_STUCK)

    def _wait_for_turn(self):  # keeps the flip rate; a late cycle is not made up for
        left_us = time.ticks_diff(self._next_us, time.ticks_us())
        if 0 < left_us <= self._half_us:
            time.sleep_us(left_us)
            self._next_us = time.ticks_add(self._next_us, self._half_us)
        else:
            self._next_us = time.ticks_add(time.ticks_us(), self._half_us)

    def _half(self, first):
        time.sleep_us(self._settle_us)
        for _ in range(self._adc.old_frames):
            self._adc.read_into(self._old)
        for frame in self._frames:
            self._adc.read_into(frame)
        for axis in range(3):
            self._sum_axis(axis, first)
        for i in range(BRIDGE, SUPPLY + 1):
            self.sums[i] += self._last_word(self._words[i - 3])

    def _sum_axis(self, axis, first):
        found = self._found
        sum24(self._raw, self._words[axis], FRAME_BYTES, len(self._raw), found)
        low, high, clip = found[1], found[2], self._adc.clip
        self.sums[first + axis] += found[0]
        if low <= -clip or high >= clip:
            self.clipped |= 1 << axis
        if low < high:
            self._moving |= 1 << axis

    def _last_word(self, at):
        frame = self._frames[-1]
        word = frame[at] << 16 | frame[at + 1] << 8 | frame[at + 2]
        return word - ((word & 0x800000) << 1)
