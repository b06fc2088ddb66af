# bp_ring.py: which flip cycle of the ring is the next to be read, and what was missed.
# The ring is written by hardware, cycle after cycle, so the place of a scan in it is its phase in the flip cycle, and
# the settling after a pulse is a number of scans that are not read. A reader who pauses finds the cycles that came
# meanwhile, up to the depth of the ring; two clocks tell how far it is behind: the place that is being written, which
# is exact but the same on every lap, and the time. Where the two do not meet, scans were missed: the place is no
# longer the phase, and nothing that is in the ring can be believed.
# Nothing here allocates: small integers only.
import time

from micropython import const

_QUICK_US = const(30)  # between two looks at the clock around a look at the place; an interrupt in between is more
_TRIES = const(20)
SLIPPED = const(-1)


class Ring:
    def __init__(self, position):  # a function: scans written whole in this lap
        self._position = position
        self.slots = self._slot = 0

    def start(self, plan, slots, scan_us, began_us):  # the first cycle is not read: no SET pulse was in it
        self._plan = plan
        self._scans = 2 * plan.scans  # of a cycle
        self.slots = slots
        self._lap_us = slots * plan.cycle_us + slots * plan.rest // plan.mhz
        self._tolerance_us = scan_us + plan.beat_us + _QUICK_US
        self._slot = self._rest = 0
        self.begin_us = began_us  # ticks at which the cycle to be read began
        self.skip(1)

    def behind(self):  # whole cycles that wait, or SLIPPED
        for _ in range(_TRIES):
            before_us = time.ticks_us()
            place = self._position()
            now_us = time.ticks_us()
            if time.ticks_diff(now_us, before_us) <= _QUICK_US:
                break
        elapsed_us = time.ticks_diff(now_us, self.begin_us)
        if elapsed_us < 0:  # it has not begun
            return 0
        ahead = (place - self._slot * self._scans) % (self.slots * self._scans)
        late_us = elapsed_us - ahead * self._plan.cycle_us // self._scans
        laps = (late_us + self._lap_us // 2) // self._lap_us
        late_us -= laps * self._lap_us
        if not -self._tolerance_us < late_us < self._tolerance_us:
            return SLIPPED
        return max(ahead // self._scans + laps * self.slots, 0)

    def left_us(self):  # until the cycle to be read is whole
        return self._plan.cycle_us - time.ticks_diff(time.ticks_us(), self.begin_us)

    def since(self):  # whole cycles since the one to be read began, by time alone
        return max(time.ticks_diff(time.ticks_us(), self.begin_us) // self._plan.cycle_us, 0)

    def first(self):  # scan at which the cycle to be read begins
        return self._slot * self._scans

    def mid_us(self):  # ticks of its RESET pulse
        return time.ticks_add(self.begin_us, self._plan.cycle_us // 2)

    def skip(self, cycles):
        self._rest += cycles * self._plan.rest
        us = cycles * self._plan.cycle_us + self._rest // self._plan.mhz
        self._rest %= self._plan.mhz
        self.begin_us = time.ticks_add(self.begin_us, us)
        self._slot = (self._slot + cycles) % self.slots
