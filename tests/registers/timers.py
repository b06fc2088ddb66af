"""TIM8 counting up and down with two PWM outputs, and TIM2 as its slave, tick by tick but computed, not stepped."""

from registers.addresses import TIM, TIM2, TIM8

CEN, UG, MOE, OSSI, BKE, BKP, BIF = 1, 1, 0x8000, 0x400, 0x1000, 0x2000, 0x80
CENTRE = 0x60  # CMS
PWM, PWM_INVERTED = 6, 7


class FlipTimer:
    """The registers of both timers. A running timer is not reconfigured: what is preloaded needs an update."""

    def __init__(self, mcu):
        self._mcu = mcu
        self._cells: dict[int, int] = {}
        self._loaded: dict[str, int] = {}  # PSC, ARR and compare values in force
        self._began = 0  # when CNT was 0, going up
        self.tim2_began = 0  # when TIM2's CNT was last set to 0 by hand or by TIM8 standing
        self.seen_break = False

    def get(self, timer: int, name: str) -> int:
        """A register's content."""
        return self._cells.get(timer + TIM[name], 0)

    @property
    def running(self) -> bool:
        """Whether TIM8 counts."""
        return bool(self.get(TIM8, "CR1") & CEN)

    @property
    def tick(self) -> int:
        """1/168 µs in one tick of TIM8."""
        return self._loaded.get("PSC", 0) + 1

    @property
    def top(self) -> int:
        """ARR in force."""
        return self._loaded.get("ARR", 0xFFFF)

    @property
    def began(self) -> int:
        """When TIM8 was at its first CNT = 0."""
        return self._began

    def half_at(self, t: int) -> int:
        """Turning points passed since the start: even after SET, odd after RESET."""
        return (t - self._began) // (self.top * self.tick)

    def read(self, address: int) -> int | None:
        """CNT counts; the others are what was written."""
        if address == TIM8 + TIM["CNT"]:
            phase = (self._mcu.now - self._began) // self.tick % (2 * self.top) if self.running else 0
            return phase if phase <= self.top else 2 * self.top - phase
        if address == TIM8 + TIM["SR"] and self._broken(self.get(TIM8, "BDTR")):
            return self._cells.get(address, 0) | BIF  # cannot be cleared while the input is active
        return self._cells.get(address, 0) if address & ~0x7F in (TIM2, TIM8) else None

    def write(self, address: int, value: int) -> bool:
        """True where the address is a timer's."""
        timer, offset = address & ~0x7F, address & 0x7F
        if timer not in (TIM2, TIM8):
            return False
        name = next((key for key, at in TIM.items() if at == offset), "")
        was_running = self._cells.get(timer + TIM["CR1"], 0) & CEN
        if was_running and name in ("PSC", "ARR", "RCR", "CCMR1", "CCMR2", "CCR1", "CCR2", "CCR3", "CCR4", "SMCR"):
            raise AssertionError(f"{name} is written while its timer runs")
        if name == "SR":
            value &= self._cells.get(address, 0)  # flags are cleared by 0
        if name == "BDTR" and value & MOE and self._broken(value):
            value &= ~MOE
        self._cells[address] = value
        if name == "EGR" and value & UG:
            self._update(timer)
        elif name == "CR1" and value & CEN and not was_running:
            self._start(timer)
        return True

    def _update(self, timer: int) -> None:
        if timer == TIM8:
            self._loaded = {name: self.get(TIM8, name) for name in ("PSC", "ARR", "CCR1", "CCR2", "CCR3", "CCR4")}
            self._began = self._mcu.now
            self._cells[TIM8 + TIM["SR"]] = self.get(TIM8, "SR") | 1
            if self.get(TIM8, "CR2") >> 4 & 7 == 2 and self.get(TIM2, "SMCR") & 0x77 == 0x14:
                self.tim2_began = self._mcu.now
        else:
            self.tim2_began = self._mcu.now

    def _start(self, timer: int) -> None:
        if timer == TIM8:
            self._began = self._mcu.now
        else:
            self.tim2_began = self._mcu.now

    def _broken(self, bdtr: int) -> bool:
        return self.seen_break and bool(bdtr & BKE) and bool(bdtr & BKP)

    def kill(self) -> None:
        """The break input goes to its active level (high) and stays there."""
        self.seen_break = True
        bdtr = self.get(TIM8, "BDTR")
        if self._broken(bdtr):
            self._cells[TIM8 + TIM["BDTR"]] = bdtr & ~MOE
            self._cells[TIM8 + TIM["SR"]] = self.get(TIM8, "SR") | BIF

    def _mode(self, channel: int) -> int:
        register = self.get(TIM8, "CCMR1" if channel < 3 else "CCMR2")
        return register >> 8 * (channel - 1 & 1) + 4 & 7

    def _active(self, channel: int) -> tuple[int, int]:
        """One active stretch of a period in ticks from CNT = 0 going up (RM0090 17.3.10, 17.3.11)."""
        compare = self._loaded.get(f"CCR{channel}", 0)
        if self._mode(channel) == PWM:  # up: CNT < CCR; down: CNT <= CCR
            return -compare, compare
        if self._mode(channel) == PWM_INVERTED:  # up: CNT >= CCR; down: CNT > CCR
            return compare, 2 * self.top - compare
        return 0, 0

    def _idle(self, channel: int) -> int | None:
        """Level of an output that is off: driven to OIS where OSSI is set, else floating."""
        if not self.get(TIM8, "BDTR") & OSSI:
            return None
        return self.get(TIM8, "CR2") >> 8 + 2 * (channel - 1) & 1

    def _on(self, channel: int) -> bool:
        return bool(self.get(TIM8, "BDTR") & MOE and self.get(TIM8, "CCER") >> 4 * (channel - 1) & 1)

    def level(self, channel: int, t: int) -> int | None:
        """The output now."""
        if not self._on(channel):
            return self._idle(channel)
        period = 2 * self.top
        phase = (t - self._began) // self.tick % period if self.running else 0
        start, end = self._active(channel)
        return int(any(start <= phase + shift < end for shift in (-period, 0)))

    def edges(self, channel: int, after: int, until: int) -> list[tuple[int, int | None]]:
        """Changes of the output in (after, until], while nothing is written."""
        if not self.running or not self._on(channel):
            return []
        if not self.get(TIM8, "CR1") & CENTRE:
            raise AssertionError("TIM8 does not count up and down")
        period, (start, end) = 2 * self.top * self.tick, self._active(channel)
        found: list[tuple[int, int | None]] = []
        for number in range((after - self._began) // period, (until - self._began) // period + 2):
            zero = self._began + number * period
            found += [(zero + start * self.tick, 1), (zero + end * self.tick, 0)]
        return [edge for edge in found if after < edge[0] <= until]

    def resets(self, after: int, until: int) -> list[int]:
        """Moments in (after, until] at which TIM2 is set to zero by TIM8's updates."""
        follows = self.get(TIM8, "CR2") >> 4 & 7 == 2 and self.get(TIM2, "SMCR") & 0x77 == 0x14
        if not self.running or not follows:
            return []
        half = self.top * self.tick
        first, last = (after - self._began) // half + 1, (until - self._began) // half
        return [self._began + number * half for number in range(first, last + 1)]
