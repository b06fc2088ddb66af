"""ADC1 started by TIM2's CC2, its codes moved by DMA2 stream 0 into a circular buffer."""

import numpy as np

from registers.addresses import ADC, ADC1, COMMON_CCR, DMA2, RCC, RCC_AHB1ENR, STREAM, STREAM0, TIM, TIM2

SAMPLE_CLOCKS = (3, 15, 28, 56, 84, 112, 144, 480)
PRESCALERS = (2, 4, 6, 8)
OVR, EN, CEN = 0x20, 1, 1
DMA2_CLOCK = 1 << 22
CONVERT_CLOCKS = 12
PCLK2_UNITS = 2  # 84 MHz


class Converter:
    """`source(times, channels)` gives the codes of scans: times (n,) in 1/168 µs -> (n, inputs) uint16."""

    def __init__(self, mcu):
        self._mcu = mcu
        self._cells: dict[int, int] = {}
        self._scans: list[int] = []  # beats whose codes are not moved yet
        self._place = self._done = 0
        self._conversion = 0  # 1/168 µs of one, 0: not known
        self.swallow = 0  # beats that will start no scan
        self.source = lambda times, channels: np.full((len(times), len(channels)), 2048, np.uint16)

    def get(self, name: str) -> int:
        """A register of ADC1."""
        return self._cells.get(ADC1 + ADC[name], 0)

    def stream(self, name: str) -> int:
        """A register of DMA2 stream 0."""
        return self._cells.get(STREAM0 + STREAM[name], 0)

    @property
    def channels(self) -> list[int]:
        """Inputs of a scan, in order."""
        registers = self.get("SQR3") | self.get("SQR2") << 30 | (self.get("SQR1") & 0xFFFFF) << 60
        count = (self.get("SQR1") >> 20 & 15) + 1 if self.get("CR1") & 0x100 else 1
        return [registers >> 5 * i & 31 for i in range(count)]

    @property
    def clock_units(self) -> int:
        """1/168 µs in one clock of the converter."""
        return PCLK2_UNITS * PRESCALERS[self._cells.get(COMMON_CCR, 0) >> 16 & 3]

    def conversion_units(self) -> int:
        """Of the slowest input."""
        if self._conversion:
            return self._conversion
        samples = [
            self.get("SMPR2") >> 3 * c & 7 if c < 10 else self.get("SMPR1") >> 3 * (c - 10) & 7 for c in self.channels
        ]
        self._conversion = (max(SAMPLE_CLOCKS[s] for s in samples) + CONVERT_CLOCKS) * self.clock_units
        return self._conversion

    def read(self, address: int) -> int | None:
        """NDTR counts down."""
        if address in (STREAM0 + STREAM["NDTR"], ADC1 + ADC["SR"]):
            self.catch_up(self._mcu.now)
        if address == STREAM0 + STREAM["NDTR"]:
            return self.stream("NDTR") - self._place - self._partial()
        if address in self._cells or ADC1 <= address < ADC1 + 0x400 or DMA2 <= address < DMA2 + 0x100:
            return self._cells.get(address, 0)
        return None

    def write(self, address: int, value: int) -> bool:
        """True where the address is the converter's or the DMA controller's."""
        self._conversion = 0
        if ADC1 <= address < ADC1 + 0x400:
            if address == ADC1 + ADC["SR"]:
                value &= self.get("SR")
            self._cells[address] = value
            return True
        if not DMA2 <= address < DMA2 + 0x100:
            return False
        if not self._dma_clock():
            return True  # without a clock nothing is written
        if address != STREAM0 and self.stream("CR") & EN and address >= STREAM0:
            raise AssertionError("a stream is written while it is enabled")
        if address == STREAM0 and value & EN and not self.stream("CR") & EN:
            self._place = 0
            self._scans.clear()
        self._cells[address] = value
        return True

    def _dma_clock(self) -> bool:
        return bool(self._mcu.cells.get(RCC + RCC_AHB1ENR, 0) & DMA2_CLOCK)

    @property
    def armed(self) -> bool:
        """On, scanning, DMA always, started by the rising CC2 of TIM2."""
        cr2 = self.get("CR2")
        return cr2 & 0x301 == 0x301 and cr2 >> 24 & 15 == 3 and cr2 >> 28 & 3 == 1

    def beats(self, after: int, until: int) -> list[int]:
        """Rises of TIM2's CC2 in (after, until]."""
        timers = self._mcu.tim8
        if not timers.get(TIM2, "CR1") & CEN or not timers.get(TIM2, "CCER") & 0x10:
            return []
        period, rise = 2 * (timers.get(TIM2, "ARR") + 1), 2 * timers.get(TIM2, "CCR2")
        starts = [timers.tim2_began, *timers.resets(after, until)]
        found = []
        for start, end in zip(starts, [*starts[1:], until + 1], strict=True):
            first = max((after - start - rise) // period + 1, 0)
            found += range(start + rise + first * period, min(end, until + 1), period)
        timers.tim2_began = starts[-1]
        return found

    def catch_up(self, until: int) -> None:
        """Scans that began or ended since the last time."""
        after, self._done = self._done, until
        scan, armed = self._scan_units(), self.armed
        for beat in self.beats(after, until) if until > after else ():
            if self.swallow:
                self.swallow -= 1
            elif armed:
                if self._scans and beat < self._scans[-1] + scan:
                    raise AssertionError("a beat came before the scan was done")
                self._scans.append(beat)
        if not self._scans:
            return
        done = [t for t in self._scans if t <= until - scan]
        self._scans = self._scans[len(done) :]
        if done and (not self._dma_clock() or not self.stream("CR") & EN or self.get("SR") & OVR):
            self._cells[ADC1 + ADC["SR"]] = self.get("SR") | OVR
        elif done:
            self._move(done)

    def _scan_units(self) -> int:
        return len(self.channels) * self.conversion_units()

    def _move(self, times: list[int]) -> None:
        ring = self._mcu.memory[self.stream("M0AR")]
        codes = self.source(np.array(times), self.channels).astype(np.uint16).ravel()
        length = self.stream("NDTR")
        view = np.frombuffer(ring, np.uint16)
        codes = codes[-length:] if len(codes) > length else codes  # older ones are overwritten anyway
        total = len(times) * len(self.channels)
        at = (self._place + total - len(codes)) % length
        ahead = min(len(codes), length - at)
        view[at : at + ahead] = codes[:ahead]
        view[: len(codes) - ahead] = codes[ahead:]
        self._place = (self._place + total) % length

    def _partial(self) -> int:
        if not self._scans:
            return 0
        return min((self._mcu.now - self._scans[0]) // self.conversion_units(), len(self.channels) - 1)


__all__ = ["CEN", "TIM", "Converter"]
