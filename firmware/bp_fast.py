# bp_fast.py: a streamed row without an allocation: the sums of a cycle, undone in fixed point (bp_hot, run by bp_fixed)
# and framed in place. A row outside the range for which bp_hot was proved is not made here: the float version makes it.
from array import array

from micropython import const

import bp_fixed as fixed

ROW_FORMAT = "<qiiiiiiffffffff"  # what this file can fill: time, six sums, temperature, currents, supply, field
_BODY = const(69)  # type, sequence, row, check sum
_TIME = const(3)
_SUMS = const(11)
_FLOATS = const(35)
_CRC = const(67)
_OFFSET = const(0x100000)  # LSB, an eighth of the converter's scale: the largest that is taken off in fixed point
_ALPHABET = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"


class FastRow:
    def __init__(self, hot, samples, kind):  # samples: summed in a half cycle; kind: of the frame
        self._hot = hot
        self._samples = samples
        self._registers = array("i", hot.REGISTERS)
        self._offsets = array("i", bytearray(24))
        self._limits = hot.LOW + hot.HIGH
        self._body = bytearray(_BODY)
        self._body[0] = kind
        self._text = bytearray(2 + 4 * _BODY // 3)
        self._text[0] = 36  # "$"
        self._text[-1] = 10
        self.ready = False

    def put_in_force(self, compensator):  # today's gains, offsets and shift; not ready where they are out of range
        hot = self._hot
        self.ready = False
        for i in range(6):
            offset_lsb = compensator.offset_lsb[i % 3]
            if not abs(offset_lsb) < _OFFSET:
                return
            self._offsets[i] = round(offset_lsb * (self._samples << hot.SHIFTS[2 * i]))
        given = compensator.gain + (compensator.shift_ut if hot.SHIFTED else ())
        if not all(low <= value <= high for value, (low, high) in zip(given, hot.SLOW_BOX)):
            return
        for value, register, per_one in zip(hot.slow(*given), hot.SLOW, hot.SLOW_PER_ONE):
            self._registers[register] = round(value * per_one)
        self.ready = True

    def frame(self, sums, limbs, sequence):  # the line of a row, None where it lies outside; sums: array("i") of 11
        hot, registers, body = self._hot, self._registers, self._body
        if fixed.take(sums, self._offsets, hot.SHIFTS, hot.INPUTS, self._limits, registers):
            return None
        fixed.run(hot.CODE, hot.COUNT, registers)
        body[1] = sequence & 0xFF
        body[2] = sequence >> 8
        fixed.copy(limbs, 8, body, _TIME)
        fixed.copy(sums, 24, body, _SUMS)
        fixed.floats(registers, hot.OUTPUTS, hot.EXPONENTS, 8, body, _FLOATS)
        crc = fixed.crc16(body, _CRC)
        body[_CRC] = crc & 0xFF
        body[_CRC + 1] = crc >> 8
        fixed.base64(body, _BODY, self._text, 1, _ALPHABET)
        return self._text
