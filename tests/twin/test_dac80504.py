"""The coil converter at the level of its SPI frames."""

import pytest
from barberpole.twin.dac80504 import Dac80504

DEVICE_ID, SYNC, GAIN, TRIGGER, BROADCAST, DAC0 = 1, 2, 4, 5, 6, 8


class Bench:
    """A converter and the voltages it has brought out."""

    def __init__(self, gain_pin=True):
        self.volts = {}
        self._dac = Dac80504(2.5, gain_pin, lambda _, channel, volts: self.volts.update({channel: volts}))

    def frame(self, address, value=0):
        self._dac.select()
        answer = self._dac.exchange(0.0, bytes((address, value >> 8, value & 0xFF)))
        self._dac.deselect(0.0)
        return answer

    def read(self, register):
        self.frame(0x80 | register)
        answer = self.frame(0)
        assert answer[0] == 0x80 | register
        return answer[1] << 8 | answer[2]


def test_wakes_at_half_scale():
    assert Bench(gain_pin=True).volts == dict.fromkeys(range(4), 2.5)
    assert Bench(gain_pin=False).volts == dict.fromkeys(range(4), 1.25)


def test_identity_and_codes_read_back():
    bench = Bench()
    assert bench.read(DEVICE_ID) == 0x0497
    bench.frame(DAC0 + 1, 0x1234)
    assert bench.read(DAC0 + 1) == 0x1234


def test_codes_gain_and_reference_divider():
    bench = Bench()
    bench.frame(DAC0, 0xC000)
    assert bench.volts[0] == pytest.approx(3.75)
    bench.frame(GAIN, 0x000E)
    assert bench.volts[0] == pytest.approx(1.875)
    bench.frame(GAIN, 0x010F)
    assert bench.volts[0] == pytest.approx(1.875)


def test_synchronous_channels_wait_for_ldac():
    bench = Bench()
    bench.frame(SYNC, 0xFF01)
    bench.frame(DAC0, 0)
    bench.frame(DAC0 + 1, 0)
    assert bench.volts[0] == 2.5
    assert bench.volts[1] == 0.0
    bench.frame(TRIGGER, 0x10)
    assert bench.volts[0] == 0.0


def test_broadcast_and_soft_reset():
    bench = Bench()
    bench.frame(BROADCAST, 0xFFFF)
    assert min(bench.volts.values()) > 4.99
    bench.frame(TRIGGER, 0x000A)
    assert bench.volts == dict.fromkeys(range(4), 2.5)


def test_half_a_frame_does_nothing():
    bench = Bench()
    bench._dac.select()
    bench._dac.exchange(0.0, bytes((DAC0, 0)))
    bench._dac.deselect(0.0)
    assert bench.volts[0] == 2.5
