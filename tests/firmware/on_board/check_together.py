# check_together.py: two converters summed in one flip cycle, one that fails left out, and that nothing is allocated.
import sys

import micropython

import bp_reasons as reasons
from fakes import Adc, Board, Flip, Pin, raises, run

sys.path.append(__file__.rsplit("/", 1)[0] + "/../../../firmware/arrays")

from bp_together import Follower, Part, Together


class Dying(Adc):  # falls silent after so many frames
    left = 1 << 20

    def read_into(self, frame):
        self.left -= 1
        if self.left < 0:
            raise reasons.Fault(reasons.ADC_SILENT)
        Adc.read_into(self, frame)


def lively(scale):  # signed codes that differ from sample to sample, mean scale (channel + 1) * state
    count = [0]

    def words(channel, state):
        count[0] += 1
        return (scale * (channel + 1) * (state or 1) + (1 if count[0] // 8 % 2 else -1)) & 0xFFFFFF

    return words


class BothFlip:  # one pulse for the bridges of all
    def __init__(self, adcs):
        self._flips = [Flip(adc) for adc in adcs]

    def set(self):
        for flip in self._flips:
            flip.set()

    def reset(self):
        for flip in self._flips:
            flip.reset()


def together():
    adcs = [Dying(lively(1000)), Dying(lively(500))]
    made = Together(tuple([Part(adc, Board) for adc in adcs]), BothFlip(adcs), Pin(), Board)
    made.live = made.parts
    made.clear()
    return made, adcs


def check_each_has_its_sums():
    made, _ = together()
    made.cycle()
    made.cycle()
    for part, scale in zip(made.parts, (1000, 500)):
        part.check()
        assert part.cycles == 2
        assert all(abs(part.sums[i] - 8 * scale * (i + 1)) <= 8 for i in range(3)), list(part.sums)
        assert all(abs(part.sums[3 + i] + 8 * scale * (i + 1)) <= 8 for i in range(3)), list(part.sums)


def check_cycle_allocates_nothing():
    made, _ = together()
    made.cycle()
    micropython.heap_lock()
    try:
        made.cycle()
    finally:
        micropython.heap_unlock()


def check_one_that_falls_silent_is_left_out():
    made, adcs = together()
    adcs[1].left = 3
    made.cycle()
    assert made.live == made.parts[:1]
    assert made.parts[1].fault.code == reasons.ADC_SILENT
    made.parts[0].check()
    assert made.parts[0].cycles == 1 and made.parts[1].cycles == 0
    adcs[0].left = 1
    assert raises(reasons.Fault, made.cycle).code == reasons.ADC_SILENT


class Frames:  # a converter whose status word has news in every third frame, or never
    def __init__(self, never=False):
        self.count = 0
        self._never = never

    def write_readinto(self, out, into):
        self.count += 1
        into[1] = 0xFF if self.count % 3 == 0 and not self._never else 0


def check_a_follower_waits_for_news():
    spi = Frames()
    Follower(spi, Pin()).read_into(bytearray(30))
    assert spi.count == 3
    fault = raises(reasons.Fault, Follower(Frames(never=True), Pin()).read_into, bytearray(30))
    assert fault.code == reasons.ADC_SILENT


run(globals())
