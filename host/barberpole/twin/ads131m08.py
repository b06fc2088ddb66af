"""The ADS131M08 at its pins: eight inputs, 24-bit frames, registers, data-ready (datasheet SBAS950B, section 8.5).

Modelled: NULL, RESET, STANDBY, WAKEUP, LOCK, UNLOCK, RREG and WREG, the status word, output checksums, gains, data
rate, both lengths of a low SYNC/RESET pin, and the two-deep data buffer, which after a pause in reading still holds the
two oldest conversions (8.5.1.9.1). Not modelled: other word lengths, input checksums, chopping, calibration registers.
"""

import binascii
import math
import struct
from collections import deque

import numpy as np

from barberpole.twin.analog import AnalogInputs

CHANNELS = 8
WORD_BYTES = 3
FRAME_BYTES = (CHANNELS + 2) * WORD_BYTES
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
        self._stuck_codes: list[int] | None = None
        self._low_since: float | None = None
        self._in = bytearray()
        self._out = b""
        self._period_us = self._start_us = 0.0
        self._coming: list[tuple[float, list[int]]] = []  # conversions that were told ahead
        self.delivered_us = 0.0  # end of the conversion that was read last
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
    def period_us(self) -> float:
        """Time between conversions in µs."""
        return self._period_us

    def ready_at(self, t_us: float) -> int:
        """When data-ready is or goes low, in µs, rounded up."""
        if self._silent or self._standby or self._low_since is not None:
            return NEVER_US
        self.catch_up(t_us)
        return int(t_us) if self._fifo else math.ceil(self._end_us(self._next))

    def catch_up(self, t_us: float) -> None:
        """Convert what has been completed up to t_us, before the inputs change: only what the buffer takes."""
        if self._silent:
            return
        done = math.floor((t_us - self._start_us) / self._period_us)
        while self._next <= done and len(self._fifo) < FIFO_DEPTH:
            self._fifo.append((self._end_us(self._next), self._convert(self._next)))
            self._next += 1
        self._next = max(self._next, done + 1)

    def select(self) -> None:
        """Chip select goes low."""
        self._in.clear()
        self._out = b""

    def exchange(self, t_us: float, data: bytes) -> bytes:
        """Clock `data` in and as many bytes out."""
        if not self._in:
            self._out = self._frame(t_us)
        at = len(self._in)
        self._in += data
        return self._out[at : at + len(data)].ljust(len(data), b"\0")

    def ahead(self, most: int) -> tuple[list[int], bytes]:
        """The next frames, up to `most`, if each is read in its time and nothing else happens; as of Wiring.ahead.

        Nothing is changed by asking: a frame counts when `take` says so. None but after a read that was no command.
        """
        quiet = self._silent or self._standby or self._low_since is not None
        if most <= 0 or quiet or len(self._in) != FRAME_BYTES or any(self._in):
            return [], b""
        self._coming = list(self._fifo)[:most]
        start_us, period_us, first = self._start_us, self._period_us, self._next
        count = most - len(self._coming)
        ends_us = [start_us + number * period_us for number in range(first, first + count + 2)]
        codes = self._convert_ahead(ends_us[:count])
        if self._coming:
            codes = np.concatenate([np.array([c for _, c in self._coming]), codes])
            ends_us = [end_us for end_us, _ in self._coming] + ends_us
        if not len(codes):
            return [], b""
        self._coming = list(zip(ends_us, codes.tolist(), strict=False))
        return [math.ceil(end_us) for end_us in ends_us[: len(codes) + 2]], framed(self._status(0xFF), codes)

    def _convert_ahead(self, ends_us: list[float]) -> np.ndarray:
        """Codes (n, CHANNELS) of the conversions that end at these times, up to the first that cannot be told yet."""
        volts = self._inputs.ahead(ends_us, self._period_us)
        if self._stuck and self._stuck_codes is not None:
            return np.array([self._stuck_codes] * len(volts), np.int64).reshape(-1, CHANNELS)
        codes = np.rint(volts * self._scale)
        np.maximum(codes, -FULL_SCALE, out=codes)
        np.minimum(codes, FULL_SCALE - 1, out=codes)
        return codes.astype(np.int64)

    def take(self) -> None:
        """The first of the frames ahead has been read."""
        if self._fifo:
            self._fifo.popleft()
        else:
            self._next += 1
        self.delivered_us, self._last = self._coming.pop(0)

    def deselect(self, t_us: float) -> bool:
        """Chip select goes high: obey the command. True when the pace of the conversions may have changed."""
        data = bytes(self._in)
        if len(data) < 2 or not any(data):
            return False
        word = data[0] << 8 | data[1]
        self._obey(t_us, word, data)
        return True

    def _obey(self, t_us: float, word: int, data: bytes) -> None:
        first, count = word >> 7 & 0x3F, (word & 0x7F) + 1
        if word >> 13 == RREG:
            self._answer = [self._register(first + i) for i in range(count)]
            if count > 1:
                self._answer.insert(0, 0xE000 | (word & 0x1FFF))
        elif word >> 13 == WREG:
            values = [data[i] << 8 | data[i + 1] for i in range(WORD_BYTES, len(data) - 1, WORD_BYTES)]
            self._write(t_us, first, values[:count])
            self._answer = [0x4000 | (word & 0x1FFF)]
        elif word == RESET and len(data) >= FRAME_BYTES:
            self.reset(t_us)
            self._answer = [RESET_ANSWER]
        elif word in (LOCK, UNLOCK):
            self._locked = word == LOCK
            self._answer = [word]
        elif word in (STANDBY, WAKEUP):
            self._sleep(t_us, word == STANDBY)
            self._answer = [word]

    def _sleep(self, t_us: float, asleep: bool) -> None:
        if self._standby and not asleep:
            self._restart(t_us)
        self._standby = asleep

    def _register(self, address: int) -> int:
        return self._status(0) if address == STATUS else self._registers.get(address, 0)

    def _write(self, t_us: float, first: int, values: list[int]) -> None:
        if self._locked:
            return
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
        self._codes_per_v = [scale * (1 << (gains >> 4 * i & 7)) * (enabled >> i & 1) for i in range(CHANNELS)]
        self._scale = np.array(self._codes_per_v)

    def _restart(self, t_us: float) -> None:
        self._start_us = t_us
        self._next = 1  # number of the conversion that is not in the buffer yet
        self._fifo: deque[tuple[float, list[int]]] = deque()
        self._last = [0] * CHANNELS

    def _end_us(self, number: int) -> float:
        return self._start_us + number * self._period_us

    def _convert(self, number: int) -> list[int]:
        if self._stuck and self._stuck_codes is not None:
            return self._stuck_codes
        volts = self._inputs.converted(self._end_us(number), self._period_us)
        codes = [round(v * scale) for v, scale in zip(volts, self._codes_per_v, strict=True)]
        self._stuck_codes = [max(-FULL_SCALE, min(FULL_SCALE - 1, code)) for code in codes]
        return self._stuck_codes

    def _status(self, new_data: int) -> int:
        shared = self._registers[MODE] & 0x0F00  # checksum type, reset flag and word length stand in both
        return self._locked << 15 | shared | new_data

    def _frame(self, t_us: float) -> bytes:
        """The bytes that the next clocks bring out: answer, data, checksum."""
        self.catch_up(t_us)
        new_data = 0xFF if self._fifo else 0
        if self._fifo:
            self.delivered_us, self._last = self._fifo.popleft()
        answer, self._answer = self._answer, None
        if answer is not None and len(answer) > 1:
            words = [word << 8 for word in answer]
        else:
            words = [(answer[0] if answer else self._status(new_data)) << 8, *self._last]
        return checked(words)


def framed(status: int, codes: np.ndarray) -> bytes:
    """The frames of conversions with these codes (n, CHANNELS): status, data, checksum."""
    words = np.empty((len(codes), 1 + CHANNELS), ">u4")
    words[:, 0] = status << 8
    words[:, 1:] = codes & 0xFFFFFF
    frames = np.zeros((len(codes), FRAME_BYTES), np.uint8)
    frames[:, :-WORD_BYTES] = words.view(np.uint8).reshape(len(codes), -1, 4)[:, :, 1:].reshape(len(codes), -1)
    data = frames.tobytes()
    starts = range(0, len(data), FRAME_BYTES)
    parts = [data[at : at + FRAME_BYTES - WORD_BYTES] for at in starts]
    return b"".join([part + struct.pack(">HB", binascii.crc_hqx(part, 0xFFFF), 0) for part in parts])


def checked(words: list[int]) -> bytes:
    """24-bit words followed by their checksum (CCITT, seed 0xFFFF) in the upper bits of one more word."""
    wide = struct.pack(f">{len(words)}I", *(word & 0xFFFFFF for word in words))
    data = bytearray(len(words) * WORD_BYTES)
    for byte in range(WORD_BYTES):
        data[byte::WORD_BYTES] = wide[byte + 1 :: 4]
    crc = binascii.crc_hqx(data, 0xFFFF)
    return bytes(data) + struct.pack(">HB", crc, 0)
