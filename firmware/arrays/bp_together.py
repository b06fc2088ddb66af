# bp_together.py: flip cycles of all sensors of an array at once. One pulse flips every bridge, as the straps are in
# series; then the converters, which one clock and one reset line keep in step, are read in turn, each conversion of
# all before the next. Where one comes while old ones are dropped, a converter may lag by that one. A converter that
# fails is left out from then on, and the others go on. A cycle makes no float and allocates nothing.
import time

from micropython import const

import bp_reasons as reasons
from bp_ads131m08 import Ads131m08
from bp_sampler import BRIDGE, SUPPLY, Sampler

_TIMEOUT_US = const(5000)  # longest wait for a conversion, as that of bp_ads131m08
_START_US = const(2000)  # from the common start to settled digital filters


class _Nothing:  # stands for a pin that a follower does not have: its reset is the first one's
    def value(self, level=None):
        return 0


class Follower(Ads131m08):  # a converter whose data-ready is not wired: its status word says what is new
    def __init__(self, spi, cs):
        Ads131m08.__init__(self, spi, cs, _Nothing(), _Nothing())

    def read_into(self, frame):  # Fault if no conversion comes
        begin = time.ticks_us()
        while True:
            self._cs.value(0)
            try:
                self._spi.write_readinto(self._null, frame)
            finally:
                self._cs.value(1)
            if frame[1]:  # a bit for each channel with a new conversion
                return
            if time.ticks_diff(time.ticks_us(), begin) > _TIMEOUT_US:
                raise reasons.Fault(reasons.ADC_SILENT)


class Part(Sampler):  # what one sensor makes of a cycle: its frames and its sums, as bp_compensate takes them
    def __init__(self, adc, board):
        Sampler.__init__(self, adc, None, board)
        self.adc = adc
        self.fault: reasons.Fault | None = None  # why it is left out

    def drop_old(self):
        for _ in range(self._adc.old_frames):
            self._adc.read_into(self._old)

    def read(self, index):
        self._adc.read_into(self._frames[index])

    def add(self, first):
        for axis in range(3):
            self._sum_axis(axis, first)
        for i in range(BRIDGE, SUPPLY + 1):
            self.sums[i] += self._last_word(self._words[i - 3])


class Together(Sampler):
    def __init__(self, parts, flip, reset, board):
        Sampler.__init__(self, None, flip, board)
        self.parts = parts
        self.live = ()
        self._reset = reset

    def start(self, ratio_code, gain1, gain2):  # all converters anew; the first one's reset is that of all
        self.live = self.parts
        for part in self.parts:
            part.fault = None
            try:
                part.adc.start(ratio_code, gain1, gain2)
            except reasons.Fault as fault:
                self.leave_out(part, fault)
        self._reset.value(0)  # so short a low does not reset: conversions begin again, in all at once
        self._reset.value(1)
        time.sleep_us(_START_US)

    def leave_out(self, part, fault):
        part.fault = fault
        self.live = tuple([other for other in self.live if other is not part])

    def clear(self):
        for part in self.parts:
            part.clear()

    def cycle(self):  # Fault where no converter is left
        Sampler.cycle(self)
        for part in self.live:
            part.cycles += 1

    def _half(self, first):
        time.sleep_us(self._settle_us)
        for part in self.live:
            try:
                part.drop_old()
            except reasons.Fault as fault:
                self.leave_out(part, fault)
        for index in range(self.samples):
            for part in self.live:
                try:
                    part.read(index)
                except reasons.Fault as fault:
                    self.leave_out(part, fault)
        for part in self.live:
            part.add(first)
        if not self.live:
            raise reasons.Fault(reasons.ADC_SILENT, "no converter of the array answers")
