"""The converter at the level of its SPI frames."""

import binascii

import pytest
from barberpole.twin import Fixed, World
from barberpole.twin.ads131m08 import NEVER_US, START_US, Ads131m08
from barberpole.twin.analog import AnalogInputs
from barberpole.twin.frames import FRAME_BYTES
from barberpole.twin.noise import Noise, NoiseLevel
from barberpole.twin.sensor_head import INPUTS, SensorHead

ID, STATUS, MODE, CLOCK, GAIN1 = range(5)
PERIOD_US = 125.0
SILENCE = NoiseLevel((0.0,) * INPUTS, (0.0,) * INPUTS, 1.25e-4)


@pytest.fixture
def make(board):
    def build(*faults, field=(20.0, -30.0, 40.0)):
        head = SensorHead(board, World.of(board, ("none",), ambient=Fixed(field)), (1, 1, 1))
        return Ads131m08(AnalogInputs(head, Noise(SILENCE, 0, 1)), board.adc.vref_v, frozenset(faults))

    return build


def frame(adc, t_us, word=0, *data):
    """One frame: its answer as words of 24 bits."""
    out = b"".join(value.to_bytes(2, "big") + b"\0" for value in (word, *data)).ljust(FRAME_BYTES, b"\0")
    adc.select()
    answer = adc.exchange(t_us, out)
    adc.deselect(t_us)
    assert binascii.crc_hqx(answer[:-3], 0xFFFF) == answer[-3] << 8 | answer[-2]
    return [int.from_bytes(answer[i : i + 3], "big") for i in range(0, FRAME_BYTES, 3)]


def read(adc, t_us, register):
    frame(adc, t_us, 0xA000 | register << 7)
    return frame(adc, t_us)[0] >> 8


def write(adc, t_us, register, *values):
    frame(adc, t_us, 0x6000 | register << 7 | len(values) - 1, *values)
    return frame(adc, t_us)[0] >> 8


def started(adc, t_us=10_000.0):
    write(adc, t_us, MODE, 0x0110, 0xFF0A, 0x0444)
    return adc


def test_registers_wake_with_the_data_sheets_values(make):
    adc = make()
    assert [read(adc, 0.0, register) for register in (ID, STATUS, MODE, CLOCK, GAIN1)] == [
        0x2810, 0x0500, 0x0510, 0xFF0E, 0x0000,
    ]  # fmt: skip


def test_writing_answers_and_is_kept(make):
    adc = make()
    assert write(adc, 0.0, GAIN1, 0x0444, 0x0001) == 0x4000 | GAIN1 << 7 | 1
    assert read(adc, 0.0, GAIN1) == 0x0444
    assert read(adc, 0.0, GAIN1 + 1) == 0x0001
    assert write(adc, 0.0, ID, 0x1234) == 0x4000
    assert read(adc, 0.0, ID) == 0x2810


def test_lock_keeps_registers_until_unlock(make):
    adc = make()
    frame(adc, 0.0, 0x0555)
    write(adc, 0.0, GAIN1, 0x0444)
    assert read(adc, 0.0, GAIN1) == 0
    assert read(adc, 0.0, STATUS) >> 15 == 1
    frame(adc, 0.0, 0x0655)
    write(adc, 0.0, GAIN1, 0x0444)
    assert read(adc, 0.0, GAIN1) == 0x0444


def test_reset_by_command_and_by_a_long_low(make):
    adc = make()
    for t_us in (10_000.0, 20_000.0):
        write(adc, t_us, GAIN1, 0x0444)
        if t_us < 15_000.0:
            frame(adc, t_us, 0x0011)
            assert frame(adc, t_us)[0] >> 8 == 0xFF28
        else:
            adc.reset_pin(t_us, 0)
            adc.reset_pin(t_us + 400.0, 1)
        assert read(adc, t_us + 400.0, GAIN1) == 0


def test_short_low_only_synchronises(make):
    adc = started(make())
    adc.reset_pin(20_000.0, 0)
    adc.reset_pin(20_010.0, 1)
    assert read(adc, 20_010.0, GAIN1) == 0x0444
    assert adc.ready_at(20_020.0) == 20_010 + PERIOD_US


def test_rate_follows_the_oversampling_ratio(make):
    adc = make()
    for code, rate_hz in ((2, 8000.0), (3, 4000.0), (0, 32000.0), (6, 500.0)):
        write(adc, 0.0, CLOCK, 0xFF02 | code << 2)
        assert adc.period_us == pytest.approx(1e6 / rate_hz)


def test_codes_are_volts_over_the_range_of_the_gain(make, board):
    adc = started(make())
    words = frame(adc, 20_000.0)
    volts = adc._inputs.head.volts(0.02)
    lsb_v = board.adc.vref_v / 2**23
    for channel in range(INPUTS):
        signed = words[1 + channel] - ((words[1 + channel] & 0x800000) << 1)
        gain = board.adc.pga if channel < 3 else 1
        assert signed * lsb_v / gain == pytest.approx(volts[channel], abs=lsb_v)


def test_inputs_out_of_range_clip(make, board):
    adc = started(make(field=(1e4, -1e4, 0.0)))
    words = frame(adc, 20_000.0)
    assert words[1 + board.adc.channels.x] == 0x7FFFFF
    assert words[1 + board.adc.channels.y] == 0x800000


def test_data_ready_falls_with_each_conversion_and_rises_when_read(make):
    adc = started(make(), 0.0)
    first = adc.ready_at(1.0)
    assert first == START_US + PERIOD_US or first == PERIOD_US  # from power-up, or from the write of CLOCK
    assert adc.ready_at(first) == first
    assert frame(adc, first)[0] >> 8 == 0x01FF
    assert adc.ready_at(first) == first + PERIOD_US
    assert frame(adc, first)[0] >> 8 == 0x0100  # nothing new


def test_after_a_pause_the_two_oldest_conversions_come_first(make, board):
    adc = started(make())
    for t_us in range(10_125, 11_000, 125):
        frame(adc, float(t_us))
    head = adc._inputs.head
    adc.catch_up(15_000.0)
    adc._inputs.change(15_000.0, lambda: head.magnetise(-1))  # long after the two were taken
    x = [frame(adc, 16_000.0)[1 + board.adc.channels.x] for _ in range(2)]
    adc.ready_at(16_125.0)
    fresh = frame(adc, 16_125.0)[1 + board.adc.channels.x]
    assert x[0] == x[1] != fresh


def test_a_flip_settles_in_three_conversions(make, board):
    adc = started(make())
    t_us = 20_000.0
    frame(adc, t_us), frame(adc, t_us), frame(adc, t_us)
    adc.catch_up(t_us)
    adc._inputs.change(t_us, lambda: adc._inputs.head.magnetise(-1))
    codes = []
    for _ in range(5):
        t_us = float(adc.ready_at(t_us))
        codes.append(frame(adc, t_us)[1 + board.adc.channels.y])
        t_us += 1.0
    assert codes[0] != codes[1] != codes[2]
    assert codes[3] == codes[4]


def test_faults(make, board):
    silent = started(make("adc_silent"))
    assert silent.ready_at(1e6) == NEVER_US
    assert frame(silent, 1e6) == [0x010000, *[0] * 8, frame(silent, 1e6)[9]]
    assert read(make("wrong_chip"), 0.0, ID) >> 8 != 0x28
    stuck = started(make("adc_stuck"))
    before = frame(stuck, 20_000.0)[1:9]
    stuck._inputs.head.magnetise(-1)
    assert frame(stuck, 30_000.0)[1:9] == before
