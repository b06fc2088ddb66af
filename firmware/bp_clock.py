# bp_clock.py: microseconds since it was made, from ticks that wrap; in four halfwords, as small integers end at 2^30.
import struct
import time
from array import array

from bp_native import add


class Clock:
    def __init__(self):
        self._ticks = time.ticks_us()
        self.limbs = array("H", bytearray(8))

    def go_to(self, ticks):  # at least every eight minutes; never back
        passed_us = time.ticks_diff(ticks, self._ticks)
        if passed_us > 0:
            add(self.limbs, passed_us)
            self._ticks = ticks

    def rest(self):  # where nothing else moves it
        self.go_to(time.ticks_us())

    def us(self):  # of the last go_to
        return struct.unpack("<Q", self.limbs)[0]

    def now_s(self):
        return (self.us() + time.ticks_diff(time.ticks_us(), self._ticks)) / 1000000
