"""All hardware of the timed boards, made by the firmware from their generated constants, on the register model."""

from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from barberpole.board import load_board
from barberpole.mcu import load_pinout
from barberpole.nominal import nominal
from barberpole_codegen.modules import generate
from registers import UNITS_PER_US, Mcu, importable
from registers.addresses import DAC, DAC_CR, DAC_DHR12R1, DAC_DHR12R2, TIM, TIM4, TIM8
from registers.mcu import ALTERNATE, ANALOG, written

TIMED = ("pybv11_timed", "nucleo_f446re")
OUTPUTS = {"PC6": 1, "PC7": 2}


class Spi:
    """A DAC80504 strapped as the board files ask; keeps what is written."""

    def __init__(self, number, baudrate, polarity, phase):
        self.written = []

    def write_readinto(self, out, into):
        self.written.append(bytes(out))
        asked = {b"\x81": b"\x00\x04\x97", b"\x84": b"\x00\x00\x0f"}
        before = self.written[-2][:1] if len(self.written) > 1 else b""
        into[:] = asked.get(before, bytes(3))


@pytest.fixture(params=TIMED)
def rig(request):
    """(board, Mcu, the firmware's Hardware)."""
    board = load_board(request.param)
    generated = {}
    for file, text in generate(board, nominal(board)).texts.items():
        name = file.removesuffix(".py")
        generated[name] = ModuleType(name)
        exec(text, generated[name].__dict__)
    pinout = load_pinout(board.micropython_board)
    pins = {pinout.label(port): port for port in _ports(pinout)} | pinout.pins
    mcu = Mcu(OUTPUTS)
    with importable(mcu, pins, generated, Spi):
        yield board, mcu, __import__("bp_hardware").Hardware()


def _ports(pinout):
    return [f"P{letter}{number}" for letter, count in pinout.ports.items() for number in range(count)]


def test_hardware_starts_samples_and_ends_with_everything_off(rig):
    board, mcu, hardware = rig
    mcu.converter.source = lambda times, channels: np.tile(np.arange(len(channels)) * 100 + 1800, (len(times), 1))
    hardware.start()
    hardware.sampler.clear()
    for _ in range(3):
        hardware.sampler.cycle()
    assert mcu.converter.channels == [getattr(board.adc.channels, name) for name in vars_of(board)]
    samples = 3 * board.adc.samples_per_half
    assert list(hardware.sampler.sums)[:3] == [samples * (1800 + 100 * i - 2048) for i in range(3)]
    assert hardware.sampler.sums[6] == 6 * 2100  # bridge voltage, from ground
    assert hardware.sampler.sums[7] == 6 * (2200 - 2048)  # a coil's shunt, about the middle
    half_us = 0.5e6 / board.flip.rate_hz
    plan = hardware.sampler._plan
    assert plan.top * plan.prescaler / UNITS_PER_US == pytest.approx(half_us)
    assert 2 * plan.compare * plan.prescaler / UNITS_PER_US == pytest.approx(board.flip.pulse_us)
    settled_us = (plan.scans - board.adc.samples_per_half + 0.5) * plan.beat / 84 - board.flip.pulse_us / 2
    assert settled_us >= board.flip.settle_us
    hardware.off()
    assert [mcu.levels[name][-1][1] for name in OUTPUTS] == [0, 0]
    assert written(mcu, TIM8 + TIM["BDTR"])[-1] & 0x8000 == 0


def vars_of(board):
    return ("x", "y", "z", "bridge", "coil_x", "coil_y", "coil_z", "supply")


def test_analogue_pins_are_analogue_and_no_coil_is_pulsed(rig):
    board, mcu, hardware = rig
    hardware.start()
    pinout = load_pinout(board.micropython_board)
    inputs = {getattr(board.adc.channels, name) for name in vars_of(board)}
    for port, number in pinout.mcu.analog.items():
        if number in inputs:
            assert mcu.mode(port) == ANALOG
    if board.dac.part != "stm32f4_dac":
        return
    enabled = next(i for i, (_, at, value) in enumerate(mcu.journal) if at == DAC + DAC_CR and value & 0x10001)
    before = {at: value for _, at, value in mcu.journal[:enabled]}
    assert before[DAC + DAC_DHR12R1] == before[DAC + DAC_DHR12R2] == 2048  # half scale first, then the outputs
    muxed = next(i for i, (_, at, v) in enumerate(mcu.journal) if at == 0x4002_0400 and v >> 12 & 3 == ALTERNATE)
    before = {at: value for _, at, value in mcu.journal[:muxed]}  # GPIOB: PB6
    assert (before[TIM4 + TIM["CCR1"]], before[TIM4 + TIM["ARR"]]) == (2048, 4095)


def test_coil_codes_reach_their_outputs(rig):
    board, mcu, hardware = rig
    hardware.dac.start(2)
    middle = 1 << board.dac.bits - 1
    hardware.coils.set((middle + 1, middle - 2, middle + 3))
    if board.dac.part == "stm32f4_dac":
        last = [written(mcu, at)[-1] for at in (DAC + DAC_DHR12R1, DAC + DAC_DHR12R2, TIM4 + TIM["CCR1"])]
    else:
        last = [frame[1] << 8 | frame[2] for frame in hardware.dac._spi.written[-3:]]
    assert last == [middle + 1, middle - 2, middle + 3]
    assert hardware.coils.current_ma(0, 2 * middle) == board.coils.full_scale_ma[0]


AMBIENT_UT, GAIN = (18.0, -6.0, 44.0), (1.03, 0.98, 1.01)


class Bridges:
    """What the converter's inputs would read: bridges flipped by the pulses, coils driven by the codes, in LSB."""

    def __init__(self, board, mcu, hardware):
        self._board, self._mcu, self._hardware = board, mcu, hardware
        self._rng = np.random.default_rng(3)

    def currents_ma(self):
        if self._board.dac.part == "stm32f4_dac":
            codes = [written(self._mcu, at)[-1] for at in (DAC + DAC_DHR12R1, DAC + DAC_DHR12R2, TIM4 + TIM["CCR1"])]
        else:
            sent = {frame[0]: frame[1] << 8 | frame[2] for frame in self._hardware.dac._spi.written[-40:]}
            codes = [sent.get(8 + channel, 32768) for channel in range(3)]
        middle = 1 << self._board.dac.bits - 1
        full = self._board.coils.full_scale_ma
        return [(code - middle) / middle * ma for code, ma in zip(codes, full, strict=True)]

    def __call__(self, times, channels):
        board, timer = self._board, self._mcu.tim8
        state = 1.0 - 2.0 * ((times - timer.began) // (timer.top * timer.tick) % 2)
        lsb_per_v = 2048 / board.adc.vref_v
        codes = np.empty((len(times), 8))
        currents = self.currents_ma()
        for axis, current_ma in enumerate(currents):
            field_ut = AMBIENT_UT[axis] + board.sensor.offset_coil_ut_per_ma * current_ma
            codes[:, axis] = 2048 + state * GAIN[axis] * board.scale_lsb_per_ut * field_ut + 40
            codes[:, 4 + axis] = 2048 + 1e-3 * current_ma * board.adc.coil_shunt_ohm * lsb_per_v
        codes[:, 3] = board.sensor.bridge_v * board.adc.bridge_divider * lsb_per_v
        codes[:, 7] = board.flip.strap_supply_v * board.adc.supply_divider * lsb_per_v
        noise = self._rng.normal(0.0, 0.9, codes.shape)
        return np.clip(np.round(codes + noise), 0, 4095)


def test_self_calibration_runs_on_timed_samples(rig):
    """Its points come from cycles after the new current has settled, though the ring is full of older ones."""
    board, mcu, hardware = rig
    mcu.converter.source = Bridges(board, mcu, hardware)
    names = ("bp_selfcal", "bp_board", "bp_calibration", "bp_trajectory")
    selfcal, constants, calibration, trajectory = map(__import__, names)
    hardware.start()
    hardware.dac.start(2)

    def after_a_pause(codes, write=hardware.coils.set):  # the collector, just before a new current
        mcu.wait(12_000 * UNITS_PER_US)
        write(codes)

    hardware.coils.set = after_a_pause
    result = selfcal.run(hardware.sampler, hardware.coils, hardware.compensator, trajectory, calibration, constants)
    assert result.reasons == []
    np.testing.assert_allclose(result.solution.gain, GAIN, rtol=3e-3)  # codes of 0.37 µT
    np.testing.assert_allclose(result.current_ratio, 1.0, atol=5e-3)
    assert result.temp_c() == pytest.approx(25.0, abs=1.0)
    assert hardware.compensator.supply_v(hardware.sampler) == pytest.approx(16.0, rel=5e-3)
    assert hardware.sampler.lost == 0


def test_a_pause_longer_than_the_ring_is_in_the_log_and_the_stream_goes_on(rig):
    board, mcu, hardware = rig
    mcu.converter.source = Bridges(board, mcu, hardware)
    serve, reasons, station_module = map(__import__, ("bp_serve", "bp_reasons", "bp_station"))
    events, rows = [], []
    station = SimpleNamespace(
        hardware=hardware,
        writer=SimpleNamespace(frame=lambda kind, row: rows.append(row), again=lambda frame: None),
        clock=SimpleNamespace(go_to=lambda us: None, us=lambda: 0),
        fast=None,
        said=(b"", b""),
        rows=0,
        state=station_module.STREAMING,
        event=lambda code, detail="", **values: events.append((code, detail)),
    )
    seen = serve._Seen(hardware.sampler)
    hardware.start()
    for number in range(12):
        serve.row(station, seen)
        if number == 5:
            mcu.wait(round(2.5e6 * board.adc.ring_cycles / board.flip.rate_hz) * UNITS_PER_US)
    assert len(rows) == 12
    assert events == [(reasons.SAMPLES_LOST, f"{hardware.sampler.lost} flip cycles")]
    assert hardware.sampler.lost >= 1.5 * board.adc.ring_cycles
    assert station.state == station_module.STREAMING
