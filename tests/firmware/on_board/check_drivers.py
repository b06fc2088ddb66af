# check_drivers.py: converter, coil driver, flip pulses and coils against fake pins and buses.
import micropython

import bp_reasons as reasons
from bp_ads131m08 import FRAME_BYTES, Ads131m08
from bp_ads8688 import Ads8688
from bp_coils import Coils
from bp_dac80504 import Dac80504
from bp_flip import Flip
from fakes import Dac, Pin, Spi, raises, run


def word(value):  # an answer in the first word of a frame
    return bytes((value >> 8, value & 255)) + bytes(FRAME_BYTES - 2)


NULL = bytes(FRAME_BYTES)


def adc_with(answers, ready=0):
    spi = Spi(answers)
    return Ads131m08(spi, Pin(1), Pin(ready), Pin(1)), spi


def check_adc_starts_and_configures():
    # register read, its answer, three writes, and two registers read back
    adc, spi = adc_with([NULL, word(0x2801), NULL, NULL, NULL, NULL, NULL, word(0x0444), NULL, word(0)])
    adc.start(2, 0x0444, 0)
    commands = [frame[0] << 8 | frame[1] for frame in spi.written]
    assert commands[0] == 0xA000  # RREG of ID
    writes = [(c, f[3] << 8 | f[4]) for c, f in zip(commands, spi.written) if c >> 13 == 3]
    assert writes == [(0x6100, 0x0110), (0x6180, 0xFF0A), (0x6200, 0x0444), (0x6280, 0)], writes
    assert all([len(frame) == FRAME_BYTES for frame in spi.written])


def check_adc_names_what_is_wrong():
    for answer, code in ((0x2410, reasons.WRONG_CHIP), (0, reasons.ADC_SILENT), (0xFFFF, reasons.ADC_SILENT)):
        adc, _ = adc_with([NULL, word(answer)])
        assert raises(reasons.Fault, adc.start, 2, 0, 0).code == code
    adc, _ = adc_with([NULL, word(0x2801), NULL, NULL, NULL, NULL, NULL, word(0x0333)])
    assert raises(reasons.Fault, adc.start, 2, 0x0444, 0).code == reasons.WRONG_CHIP


def check_adc_times_out():
    adc, _ = adc_with([], ready=1)
    assert raises(reasons.Fault, adc.read_into, bytearray(FRAME_BYTES)).code == reasons.ADC_SILENT


def check_adc_read_into_allocates_nothing():
    adc, spi = adc_with([])
    spi.write_readinto = None
    adc._spi = QuietSpi()
    frame = bytearray(FRAME_BYTES)
    micropython.heap_lock()
    try:
        adc.read_into(frame)
    finally:
        micropython.heap_unlock()
    assert frame[0] == 5


class QuietSpi:
    def write_readinto(self, out, into):
        into[0] = 5


class BrokenSpi:
    def write_readinto(self, out, into):
        raise OSError(5)


def check_chip_select_is_released_on_error():
    cs = Pin(1)
    raises(OSError, Ads131m08(BrokenSpi(), cs, Pin(0), Pin(1)).read_into, bytearray(FRAME_BYTES))
    assert cs.level == 1
    cs = Pin(1)
    raises(OSError, Dac80504(BrokenSpi(), cs).write, 0, 1)
    assert cs.level == 1


def check_dac_frames():
    spi = Spi([bytes(3), b"\x00\x04\x97", bytes(3), b"\x00\x00\x0f"])
    dac = Dac80504(spi, Pin(1))
    dac.start(2)
    assert spi.written == [b"\x81\x00\x00", b"\x00\x00\x00", b"\x84\x00\x00", b"\x00\x00\x00"], spi.written
    dac.write(2, 0xABCD)
    assert spi.written[-1] == b"\x0a\xab\xcd"
    assert raises(reasons.Fault, Dac80504(Spi(), Pin(1)).start, 2).code == reasons.WRONG_CHIP


def check_dac_never_changes_its_gain():  # that would be a pulse of current through every coil
    spi = Spi([bytes(3), b"\x00\x04\x97", bytes(3), bytes(3)])
    assert raises(reasons.Fault, Dac80504(spi, Pin(1)).start, 2).code == reasons.WRONG_CHIP
    assert not [frame for frame in spi.written if frame[0] == 4]


def check_dac_write_allocates_nothing():
    dac = Dac80504(QuietSpi(), Pin(1))
    micropython.heap_lock()
    try:
        dac.write(1, 40000)
    finally:
        micropython.heap_unlock()


class Ads8688Chip:  # registers and channel sequence of an ADS8688 (SBAS582): codes(channel) gives the straight binary
    def __init__(self, codes):
        self.registers = {}
        self._codes = codes
        self._next = None

    def write_readinto(self, out, into):
        assert len(out) == len(into) == 4
        result = 0 if self._next is None else self._codes(self._next)
        into[0] = into[1] = 0
        into[2], into[3] = result >> 8, result & 255
        if out[0] == 0xA0:
            self._next = 0
        elif out[0] == 0:
            self._next = None if self._next is None else (self._next + 1) % 8
        elif out[0] < 0x80 and out[0] & 1:
            self.registers[out[0] >> 1] = out[1]
        elif out[0] < 0x80:
            into[2] = self.registers.get(out[0] >> 1, 0)


def check_ads8688_starts_and_reads_signed_words():
    chip = Ads8688Chip(lambda channel: (0x0000, 0x7FFF, 0x8000, 0x8001, 0xFFFF, 0x1234, 0x8000, 0xC000)[channel])
    adc = Ads8688(chip, Pin(1))
    adc.start(2)
    assert chip.registers == {1: 0xFF, 5: 2, 6: 2, 7: 2, 8: 2, 9: 2, 10: 2, 11: 2, 12: 2}
    frame = bytearray(FRAME_BYTES)
    micropython.heap_lock()
    try:
        adc.read_into(frame)
        adc.read_into(frame)
    finally:
        micropython.heap_unlock()
    words = [frame[3 + 3 * i] << 16 | frame[4 + 3 * i] << 8 | frame[5 + 3 * i] for i in range(8)]
    signed = [word - 0x1000000 if word & 0x800000 else word for word in words]
    assert signed == [-0x8000, -1, 0, 1, 0x7FFF, 0x1234 - 0x8000, 0, 0x4000], signed


def check_ads8688_names_what_is_wrong():
    for byte in (0, 0xFF):
        assert raises(reasons.Fault, Ads8688(Constant(byte), Pin(1)).start, 2).code == reasons.ADC_SILENT
    assert raises(reasons.Fault, Ads8688(Constant(0x5A), Pin(1)).start, 2).code == reasons.WRONG_CHIP
    cs = Pin(1)
    raises(OSError, Ads8688(BrokenSpi(), cs).start, 2)
    assert cs.level == 1


class Constant:  # a bus that reads the same byte for ever
    def __init__(self, byte):
        self._byte = byte

    def write_readinto(self, out, into):
        for i in range(len(into)):
            into[i] = self._byte


def check_flip_pulses_one_pin_at_a_time():
    journal = []
    irq = []
    flip = Flip(Pin(1, "set", journal), Pin(1, "reset", journal), 8, lambda: irq.append("off"), irq.append)
    assert journal == [("set", 0), ("reset", 0)]
    flip.set()
    flip.reset()
    assert journal[2:] == [("set", 1), ("set", 0), ("reset", 1), ("reset", 0)]
    assert irq == ["off", None, "off", None]


def check_flip_ends_low_when_interrupted():
    pin = Pin(0)
    flip = Flip(pin, Pin(0), "no number", lambda: None, lambda state: None)
    raises(TypeError, flip.set)
    assert pin.level == 0


def check_coils_are_zero_until_driven():
    dac = Dac()
    coils = Coils(dac, (2, 0, 1), (5.0, 5.0, 4.0))
    assert dac.codes[:3] == [32768] * 3
    coils.set((1, 2, 3))
    assert dac.codes[:3] == [2, 3, 1]
    coils.zero()
    assert dac.codes[:3] == [32768] * 3
    assert coils.current_ma(0, 65536) == 5.0 and coils.current_ma(2, 16384) == -2.0


run(globals())
