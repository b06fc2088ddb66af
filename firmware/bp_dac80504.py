# bp_dac80504.py: four 16-bit voltages from the DAC80504.
# Frames of 24 bits: read flag and register, then 16 bits of data, most significant first; mode 1.
# write() allocates nothing. Strap RSTSEL high, so that it wakes at half scale: that is no coil current.
from micropython import const

import bp_reasons as reasons

_REG_ID = const(0x01)
_REG_GAIN = const(0x04)
_REG_DAC0 = const(0x08)
_READ = const(0x80)
_ID = const(0x04)  # high byte of DEVICE ID: 16 bits, four channels
_WAKES_AT_HALF = const(0x80)  # RSTSEL in DEVICE ID
_GAIN_2 = const(0x000F)  # every output twice the reference


class Dac80504:
    def __init__(self, spi, cs):
        self.zero = 32768
        self._spi = spi
        self._cs = cs
        self._out = bytearray(3)
        self._in = bytearray(3)

    def start(self, gain):  # 1 or 2: output range in units of the reference
        found = self._read(_REG_ID)
        if found >> 8 != _ID:
            raise reasons.Fault(reasons.WRONG_CHIP, "the coil driver is no DAC80504")
        if not found & _WAKES_AT_HALF:
            raise reasons.Fault(reasons.WRONG_CHIP, "the DAC80504's RSTSEL pin is not strapped high")
        # The GAIN pin is strapped to the board's gain and RSTSEL to half scale, so that the coils carry no current from
        # power-up on (SBAS871C, 9.3.1.1). A write that changed the gain would be a pulse of half the full scale.
        wanted = _GAIN_2 if gain == 2 else 0
        if self._read(_REG_GAIN) & _GAIN_2 != wanted:
            raise reasons.Fault(reasons.WRONG_CHIP, "the DAC80504's GAIN pin is not strapped as the board file says")

    def write(self, channel, code):
        self._transfer(_REG_DAC0 + channel, code)

    def _read(self, register):  # the answer comes with the frame that follows
        self._transfer(_READ | register, 0)
        self._transfer(0, 0)
        return self._in[1] << 8 | self._in[2]

    def _transfer(self, register, data):
        out = self._out
        out[0], out[1], out[2] = register, data >> 8, data & 0xFF
        self._cs.value(0)
        try:
            self._spi.write_readinto(out, self._in)
        finally:
            self._cs.value(1)
