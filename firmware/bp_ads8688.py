# bp_ads8688.py: raw conversions of the ADS8688, eight 16-bit channels one after the other (datasheet SBAS582).
# A frame is 32 bits: a command, then the result of the channel that the frame before has chosen. There is no data-ready
# line: each read asks for its conversions. read_into() fills the frame of bp_sampler, each result as a signed 24-bit
# word, and allocates nothing. Mode 1 (clock idle low, data valid on the falling edge); bus and pin are handed in.
import time

from micropython import const

import bp_reasons as reasons
from bp_sampler import FRAME_BYTES

CHANNELS = const(8)
_CMD_RESET = const(0x85)  # first byte of a command: all of them have a second byte of zero (command register map)
_CMD_SCAN = const(0xA0)  # AUTO_RST: from the lowest enabled channel on, one more with each frame
_REG_SEQUENCE = const(0x01)  # AUTO_SEQ_EN, a bit for each channel (program register map)
_REG_RANGE = const(0x05)  # of channel 0, the others follow
_WRITE = const(1)  # bit 0 of the first byte, below the address
_START_US = const(20)


class Ads8688:
    def __init__(self, spi, cs):
        self.old_frames = 0  # it keeps none
        self.clip = 0x7FFF  # an input out of range reads as this code, or as its complement
        self._spi = spi
        self._cs = cs
        self._out = bytearray(4)
        self._in = bytearray(4)

    def start(self, input_range):  # 0, 1, 2: 2.5, 1.25, 0.625 times the reference of 4.096 V, both signs
        self._transfer(_CMD_RESET, 0)
        time.sleep_us(_START_US)
        self._write(_REG_SEQUENCE, 0xFF)
        for channel in range(CHANNELS):
            self._write(_REG_RANGE + channel, input_range)
        # It has no identity register: registers that are kept, of all ones and of few, are the sign of life.
        found = (self._read(_REG_SEQUENCE), self._read(_REG_RANGE), self._read(_REG_RANGE + CHANNELS - 1))
        if found in ((0, 0, 0), (0xFF, 0xFF, 0xFF)):
            raise reasons.Fault(reasons.ADC_SILENT, "nothing answers on the converter's bus")
        if found != (0xFF, input_range, input_range):
            raise reasons.Fault(reasons.WRONG_CHIP, "the ADS8688 does not keep its registers")

    def read_into(self, frame):  # a conversion of every channel
        if len(frame) != FRAME_BYTES:
            raise ValueError
        self._transfer(_CMD_SCAN, 0)
        at = 3
        for _ in range(CHANNELS):
            self._transfer(0, 0)
            high = self._in[2] ^ 0x80  # from straight binary to two's complement
            frame[at] = 0xFF if high & 0x80 else 0
            frame[at + 1] = high
            frame[at + 2] = self._in[3]
            at += 3

    def _write(self, register, value):
        self._transfer(register << 1 | _WRITE, value)

    def _read(self, register):  # the answer comes in the third byte of the same frame
        self._transfer(register << 1, 0)
        return self._in[2]

    def _transfer(self, first, second):
        self._out[0], self._out[1] = first, second
        self._cs.value(0)
        try:
            self._spi.write_readinto(self._out, self._in)
        finally:
            self._cs.value(1)
