# check_timed.py: the timed sampler in MicroPython itself, on a ring that a clock fills: sums, pauses, no allocation.
# The registers are proved elsewhere (test_timers.py); here they are a dictionary that nobody looks at.
import sys
from array import array

import micropython

from fakes import run


class Clock:  # two microseconds a look
    def __init__(self):
        self.now = 0

    def ticks_us(self):
        self.now += 2
        return self.now

    def ticks_diff(self, end, start):
        return end - start

    def ticks_add(self, ticks, delta):
        return ticks + delta

    def sleep_us(self, us):
        self.now += us


class Memory(dict):
    def __getitem__(self, address):
        return self.get(address, 0)


class Registers:
    def __init__(self):
        self.mem8, self.mem32 = Memory(), Memory()

    def __getattr__(self, name):
        return 0


class Names:
    pass


for name in ("machine", "pyb", "uctypes"):
    sys.modules[name] = Names()
sys.modules["stm"] = Registers()
sys.modules["time"] = time = Clock()

from bp_ring import SLIPPED  # noqa: E402
from bp_timed import TimedSampler  # noqa: E402
from bp_timers import Plan  # noqa: E402

SCANS, KEPT, SLOTS = 10, 8, 24
RATE_HZ = 100


class Scan:  # place by the clock; codes tell the axis, the half cycle and the cycle
    def __init__(self):
        self.ring = array("H", bytearray(2 * 2 * SCANS * 8 * SLOTS))
        self.scan_us = 16
        self.held = -1
        for i in range(len(self.ring)):
            scan, channel = i // 8, i % 8
            self.ring[i] = 1000 + 100 * channel + (1000 if scan // SCANS % 2 == 0 else 0) + (scan & 1)

    def position(self):
        if self.held >= 0:
            return self.held
        passed = time.now - self.begin_us + 234  # a scan begins in the middle of its beat and takes 16 us
        return passed // 500 % (2 * SCANS * SLOTS)

    def silent(self):
        return False

    def stop(self):
        pass

    def start(self, used):
        self.begin_us = time.now


class Pulses:
    def off(self):
        pass

    def prepare(self, plan):
        pass

    def start(self, plan):
        return time.now

    def stopped(self):
        return False


class Board:
    SAMPLES_PER_HALF = KEPT


def sampler_of():
    return TimedSampler(Pulses(), Scan(), Plan(RATE_HZ, 8, 1, SCANS, 168000000, 84000000), Board)


def check_sums_have_their_phase():
    sampler = sampler_of()
    sampler.cycle()
    sampler.cycle()
    kept = 2 * KEPT
    assert list(sampler.sums)[:6] == [kept * (2000 + 100 * i - 2048) + KEPT for i in range(3)] + [
        kept * (1000 + 100 * i - 2048) + KEPT for i in range(3)
    ], list(sampler.sums)
    assert sampler.cycles == 2 and sampler.lost == 0
    sampler.check()


def check_cycle_allocates_nothing():
    sampler = sampler_of()
    sampler.cycle()
    micropython.heap_lock()
    try:
        for _ in range(3):
            sampler.clear()
            sampler.cycle()
        sampler.fresh()
        sampler.cycle()
    finally:
        micropython.heap_unlock()
    assert sampler.lost == 0


def check_a_pause_within_the_ring_costs_nothing_and_a_longer_one_is_counted():
    sampler = sampler_of()
    sampler.cycle()
    before = sampler.mid_us
    time.sleep_us(120000)
    for _ in range(5):
        sampler.cycle()
    assert sampler.lost == 0 and sampler.mid_us - before == 50000
    time.sleep_us(300000)
    sampler.cycle()
    missing = (sampler.mid_us - before - 50000) // 10000 - 1
    assert sampler.lost == missing > 0, (sampler.lost, missing)


def check_a_place_that_stands_still_is_a_slip():
    sampler = sampler_of()
    sampler.cycle()
    sampler._scan.held = sampler._scan.position()
    time.sleep_us(5000)
    assert sampler._ring.behind() == SLIPPED


run(globals())
