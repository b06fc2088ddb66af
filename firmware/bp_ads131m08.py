# bp_ads131m08.py: raw conversions of the ADS131M08, eight 24-bit channels (datasheet SBAS950B).
# read_into() allocates nothing, so sampling never waits for the collector. The bus and the pins are handed in;
# the bus runs in mode 1 (clock idle low, data valid on the falling edge).
import time

from micropython import const

import bp_reasons as reasons

CHANNELS = const(8)
FRAME_BYTES = const(30)  # status, eight channels, check sum: ten words of 24 bits

_REG_ID = const(0x00)
_REG_MODE = const(0x02)
_REG_CLOCK = const(0x03)
_REG_GAIN1 = const(0x04)
_REG_GAIN2 = const(0x05)
_CMD_RESET = const(0x0011)
_CMD_RREG = const(0xA000)
_CMD_WREG = const(0x6000)
_ID = const(0x28)  # high byte of the ID register: eight channels
_NOBODY = (0x0000, 0xFFFF)  # a data line that nobody drives
_MODE_CLEAR_RESET = const(0x0110)  # 24-bit words, reset flag cleared, time-out on
_CLOCK_ALL_ON = const(0xFF02)  # eight channels on, high-resolution power mode; bits 4:2 are the oversampling ratio
_RESET_PULSE_US = const(400)  # more than 2048 clocks at 8.192 MHz; a shorter low would only synchronise
_START_US = const(2000)  # reset to registers ready, and to settled digital filters
_TIMEOUT_US = const(5000)  # longest wait for a conversion: several periods at the slowest rate in use


class Ads131m08:
    def __init__(self, spi, cs, drdy, reset):
        self.old_frames = 2  # conversions that the chip still holds after a pause in reading it
        self.clip = 0x7FFFFF  # an input out of range reads as this code, or as its complement
        self._spi = spi
        self._cs = cs
        self._drdy = drdy
        self._reset = reset
        self._null = bytes(FRAME_BYTES)
        self._frame = bytearray(FRAME_BYTES)

    def start(self, ratio_code, gain1, gain2):  # CLOCK.OSR code, and the GAIN1 and GAIN2 registers as they are
        self._reset.value(0)
        time.sleep_us(_RESET_PULSE_US)
        self._reset.value(1)
        time.sleep_us(_START_US)
        found = self._read_register(_REG_ID)
        if found in _NOBODY:
            raise reasons.Fault(reasons.ADC_SILENT, "nothing answers on the converter's bus")
        if found >> 8 != _ID:
            raise reasons.Fault(reasons.WRONG_CHIP, "the converter is no ADS131M08")
        self._write_register(_REG_MODE, _MODE_CLEAR_RESET)
        self._write_register(_REG_CLOCK, _CLOCK_ALL_ON | ratio_code << 2)
        self._write_register(_REG_GAIN1, gain1)
        self._write_register(_REG_GAIN2, gain2)
        if self._read_register(_REG_GAIN1) != gain1 or self._read_register(_REG_GAIN2) != gain2:
            raise reasons.Fault(reasons.WRONG_CHIP, "the ADS131M08 does not keep its gain")

    def read_into(self, frame):  # waits for the next conversion; Fault if none comes
        begin = time.ticks_us()
        while self._drdy.value():
            if time.ticks_diff(time.ticks_us(), begin) > _TIMEOUT_US:
                raise reasons.Fault(reasons.ADC_SILENT)
        self._cs.value(0)
        try:
            self._spi.write_readinto(self._null, frame)
        finally:
            self._cs.value(1)

    def _command(self, word, data=0):
        out = bytearray(FRAME_BYTES)
        out[0], out[1] = word >> 8, word & 0xFF
        out[3], out[4] = data >> 8, data & 0xFF
        self._cs.value(0)
        try:
            self._spi.write_readinto(out, self._frame)
        finally:
            self._cs.value(1)

    def _write_register(self, register, value):
        self._command(_CMD_WREG | register << 7, value)

    def _read_register(self, register):  # the answer is the first word of the frame that follows
        self._command(_CMD_RREG | register << 7)
        self._command(0)
        return self._frame[0] << 8 | self._frame[1]
