"""The ADS131M08 at its pins: eight inputs, 24-bit frames, registers, data-ready (datasheet SBAS950B, section 8.5).

Modelled: NULL, RESET, STANDBY, WAKEUP, LOCK, UNLOCK, RREG and WREG, the status word, output checksums, gains, data
rate, both lengths of a low SYNC/RESET pin, and the two-deep data buffer, which after a pause in reading still holds the
two oldest conversions (8.5.1.9.1). Not modelled: other word lengths, input checksums, chopping, calibration registers.
"""

import math
from collections import deque

import numpy as np

from barberpole.twin.analog import AnalogInputs
from barberpole.twin.frames import (
    CHANNELS,
    DATA_BYTES,
    FRAME_BYTES,
    NOTHING,
    WORD_BYTES,
    Ahead,
    checked,
    data_words,
    word,
)

MODULATOR_MHZ = 4.096  # half of the 8.192 MHz crystal
OVERSAMPLING = (128, 256, 512, 1024, 2048, 4096, 8192, 16384)  # by CLOCK.OSR
RESET_PULSE_US = 250  # 2048 periods of the crystal; a shorter low pulse synchronises
START_US = 500  # power-up or reset to the first conversion's start
FIFO_DEPTH = 2
FULL_SCALE = 1 << 23

NULL, RESET, STANDBY, WAKEUP, LOCK, UNLOCK = 0x0000, 0x0011, 0x0022, 0x0033, 0x0555, 0x0655
RREG, WREG = 0b101, 0b011  # bits 15..13 of the command
ID, STATUS, MODE, CLOCK, GAIN1, GAIN2 = range(6)
DEFAULTS = {ID: 0x2810, STATUS: 0x0500, MODE: 0x0510, CLOCK: 0xFF0E, 0x06: 0x0600}
RESET_ANSWER = 0xFF28
OTHER_PART = 0x2410  # an ADS131M04
NEVER_US = 1 << 60


class Ads131m08:
    """One converter: `select`, `exchange` and `deselect` are its chip select and its bytes, times are µs."""

    def __init__(self, inputs: AnalogInputs, vref_v: float, faults: frozenset[str] = frozenset()):
        self._inputs = inputs
        self._vref_v = vref_v
        self._silent = "adc_silent" in faults
        self._stuck = "adc_stuck" in faults
        self._wrong = "wrong_chip" in faults
        self._stuck_data: bytes | None = None
        self._most_ahead = 0
        self._low_since: float | None = None
        self._in = bytearray()
        self._out = b""
        self._period_us = self._start_us = 0.0
        self.reset(0.0)

    def reset(self, t_us: float) -> None:
        """Registers to their defaults, conversions start anew."""
        self._registers = dict(DEFAULTS)
        if self._wrong:
            self._registers[ID] = OTHER_PART
        self._locked = self._standby = False
        self._answer: list[int] | None = None
        self._configure(t_us)
        self._restart(t_us + START_US)

    def reset_pin(self, t_us: float, level: int) -> None:
        """SYNC/RESET: a long low resets, a short one restarts the conversions."""
        if not level:
            self._low_since = t_us
        elif self._low_since is not None:
            if t_us - self._low_since >= RESET_PULSE_US:
                self.reset(t_us)
            else:
                self._restart(t_us)
            self._low_since = None

    @property
    def delivered_us(self) -> float:
        """End of the conversion that was read last, µs."""
        return self._end_us(self._read_number)

    @property
    def period_us(self) -> float:
        """Time between conversions in µs."""
        return self._period_us

    def ready_at(self, t_us: float) -> int:
        """When data-ready is or goes low, in µs, rounded up."""
        if self._silent or self._standby or self._low_since is not None:
            return NEVER_US
        self._complete(t_us)
        return int(t_us) if self._fifo else math.ceil(self._end_us(self._next))

    def catch_up(self, t_us: float) -> None:
        """The inputs change now: what has been completed has not seen it, what has not is not known any more."""
        self._complete(t_us)
        self._data = {number: self._data[number] for number in self._fifo if number in self._data}

    def _complete(self, t_us: float) -> None:
        """Put what ended before t_us into the buffer, as far as there is room; the oldest stay."""
        if self._silent:
            return
        done = math.floor((t_us - self._start_us) / self._period_us)
        while self._next <= done and len(self._fifo) < FIFO_DEPTH:
            self._fifo.append(self._next)
            self._next += 1
        self._next = max(self._next, done + 1)
        if self._fifo and not self._inputs.will_know(self._end_us(self._fifo[0]), t_us):
            self._known(len(self._fifo))

    def select(self) -> None:
        """Chip select goes low."""
        self._in.clear()
        self._out = b""

    def exchange(self, t_us: float, data: bytes) -> bytes:
        """Clock `data` in and as many bytes out."""
        if not self._in:
            self._out = self._frame(t_us, not any(data))
        at = len(self._in)
        self._in += data
        return self._out[at : at + len(data)].ljust(len(data), b"\0")

    def ahead(self, most: int) -> Ahead:
        """The next frames, up to `most`; none but after a read that was no command.

        Nothing is changed by asking: a frame counts when `take` says so.
        """
        quiet = self._silent or self._standby or self._low_since is not None
        if most <= 0 or quiet or len(self._in) != FRAME_BYTES or any(self._in):
            return NOTHING
        self._most_ahead = most
        numbers = self._known(most)
        if not numbers:
            return NOTHING
        status = word(self._status(0xFF))
        frames = b"".join([checked(status + self._data[number]) for number in numbers])
        return Ahead([math.ceil(self._end_us(number)) for number in self._coming(len(numbers) + 2)], frames)

    def take(self, count: int) -> None:
        """The first `count` of the frames ahead have been read."""
        for number in self._coming(count):
            self._last = self._data.pop(number)
            self._read_number = number
        for _ in range(min(count, len(self._fifo))):
            self._fifo.popleft()
        self._next = max(self._next, self._read_number + 1)

    def coming_us(self, count: int) -> list[float]:
        """Ends of the conversions that are read next, one after the other."""
        return [self._end_us(number) for number in self._coming(count)]

    def _coming(self, count: int) -> list[int]:
        """Numbers of the conversions that are read next."""
        completed = list(self._fifo)[:count]
        return [*completed, *range(self._next, self._next + count - len(completed))]

    def _known(self, most: int) -> list[int]:
        """Numbers of the conversions to come, up to `most`, whose data can be told, all that are complete among them.

        They are converted together, because one costs nearly as much as ten.
        """
        numbers = self._coming(most)
        missing = [number for number in numbers if number not in self._data]
        if missing:
            completed = sum(number < self._next for number in missing)
            found = self._convert([self._end_us(number) for number in missing], completed)
            self._data = {number: self._data[number] for number in numbers if number in self._data}
            self._data.update(zip(missing, found, strict=False))
        return [number for number in numbers if number in self._data]

    def _convert(self, ends_us: list[float], completed: int) -> list[bytes]:
        """Data words of conversions by their ends, up to the first that cannot be told yet."""
        volts = self._inputs.volts(ends_us, completed, self._period_us)
        if not len(volts):
            return []
        codes = np.rint(volts * self._codes_per_v)
        np.maximum(codes, -FULL_SCALE, out=codes)
        np.minimum(codes, FULL_SCALE - 1, out=codes)
        data = data_words(codes)
        if self._stuck:
            self._stuck_data = self._stuck_data or data[0]
            data = [self._stuck_data] * len(data)
        return data

    def deselect(self, t_us: float) -> bool:
        """Chip select goes high: obey the command. True when the pace of the conversions may have changed."""
        data = bytes(self._in)
        if len(data) < 2 or not any(data):
            return False
        self._obey(t_us, data[0] << 8 | data[1], data)
        return True

    def _obey(self, t_us: float, command: int, data: bytes) -> None:
        first, count = command >> 7 & 0x3F, (command & 0x7F) + 1
        if command >> 13 == RREG:
            self._answer = [self._register(first + i) for i in range(count)]
            if count > 1:
                self._answer.insert(0, 0xE000 | (command & 0x1FFF))
        elif command >> 13 == WREG:
            values = [data[i] << 8 | data[i + 1] for i in range(WORD_BYTES, len(data) - 1, WORD_BYTES)]
            self._write(t_us, first, values[:count])
            self._answer = [0x4000 | (command & 0x1FFF)]
        elif command == RESET and len(data) >= FRAME_BYTES:
            self.reset(t_us)
            self._answer = [RESET_ANSWER]
        elif command in (LOCK, UNLOCK):
            self._locked = command == LOCK
            self._answer = [command]
        elif command in (STANDBY, WAKEUP):
            self._sleep(t_us, command == STANDBY)
            self._answer = [command]

    def _sleep(self, t_us: float, asleep: bool) -> None:
        if self._standby and not asleep:
            self._restart(t_us)
        self._standby = asleep

    def _register(self, address: int) -> int:
        return self._status(0) if address == STATUS else self._registers.get(address, 0)

    def _write(self, t_us: float, first: int, values: list[int]) -> None:
        if self._locked:
            return
        self.catch_up(t_us)
        self._known(len(self._fifo))  # with the gains that were
        for address, value in enumerate(values, first):
            if address not in (ID, STATUS):
                self._registers[address] = value
        self._configure(t_us)

    def _configure(self, t_us: float) -> None:
        """What the registers mean: conversion period and codes per volt. A new period starts the conversions anew."""
        period_us = OVERSAMPLING[self._registers[CLOCK] >> 2 & 7] / MODULATOR_MHZ
        if period_us != self._period_us:
            self._period_us = period_us
            self._restart(t_us)
        gains = self._registers.get(GAIN1, 0) | self._registers.get(GAIN2, 0) << 16
        scale = FULL_SCALE / self._vref_v
        enabled = self._registers[CLOCK] >> 8
        self._codes_per_v = np.array(
            [scale * (1 << (gains >> 4 * i & 7)) * (enabled >> i & 1) for i in range(CHANNELS)]
        )

    def _restart(self, t_us: float) -> None:
        self._start_us = t_us
        self._next = 1  # number of the conversion that is not in the buffer yet
        self._fifo: deque[int] = deque()  # numbers of those that are complete and not read
        self._data: dict[int, bytes] = {}  # by number, of conversions that are not read
        self._last = bytes(DATA_BYTES)
        self._read_number = 0  # of the conversion that these are from

    def _end_us(self, number: int) -> float:
        return self._start_us + number * self._period_us

    def _status(self, new_data: int) -> int:
        shared = self._registers[MODE] & 0x0F00  # checksum type, reset flag and word length stand in both
        return self._locked << 15 | shared | new_data

    def _frame(self, t_us: float, quiet: bool) -> bytes:
        """The bytes that the next clocks bring out: answer, data, checksum; `quiet`: nothing is commanded."""
        self._complete(t_us)
        new_data = 0xFF if self._fifo else 0
        if self._fifo:
            self._known(1 + self._most_ahead if quiet else 1)
            self._deliver()
        answer, self._answer = self._answer, None
        if answer is not None and len(answer) > 1:
            return checked(b"".join(map(word, answer)))
        return checked(word(answer[0] if answer else self._status(new_data)) + self._last)

    def _deliver(self) -> None:
        """The oldest conversion in the buffer is read."""
        self._read_number = self._fifo.popleft()
        self._last = self._data.pop(self._read_number)
