# timed_fakes.py: the timed sampler on a ring that a clock fills; the registers are a dictionary that nobody looks at.
import sys
from array import array


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

from bp_ring import SLIPPED  # noqa: E402, F401
from bp_timed import TimedSampler  # noqa: E402
from bp_timers import Plan  # noqa: E402

SCANS, KEPT, SLOTS = 10, 8, 24
RATE_HZ = 100
CYCLE_US = 10000


class Scan:  # place by the clock; codes tell the axis, the half cycle and the cycle
    def __init__(self):
        self.ring = array("H", bytearray(2 * 2 * SCANS * 8 * SLOTS))
        self.scan_us = 16
        self.held = -1
        self.silences = 0  # so many looks find that no code can reach the ring
        self.starts = 0
        for i in range(len(self.ring)):
            scan, channel = i // 8, i % 8
            self.ring[i] = 1000 + 100 * channel + (1000 if scan // SCANS % 2 == 0 else 0) + (scan & 1)

    def position(self):
        if self.held >= 0:
            return self.held
        passed = time.now - self.begin_us + 234  # a scan begins in the middle of its beat and takes 16 us
        return passed // 500 % (2 * SCANS * SLOTS)

    def silent(self):
        if self.silences:
            self.silences -= 1
            return True
        return False

    def stop(self):
        pass

    def start(self, used):
        self.starts += 1
        self.begin_us = time.now


class Pulses:
    def __init__(self):
        self.broken = False
        self.on = False

    def off(self):
        self.on = False

    def prepare(self, plan):
        pass

    def start(self, plan):
        self.on = True
        return time.now

    def stopped(self):
        return self.broken


class Board:
    SAMPLES_PER_HALF = KEPT


def sampler_of():
    return TimedSampler(Pulses(), Scan(), Plan(RATE_HZ, 8, 1, SCANS, 168000000, 84000000), Board)
