"""Voltages of the bridges against the equation in the module's docstring, worked out here another way."""

import math

import numpy as np
import pytest
from barberpole.twin import Constant, Fixed, World
from barberpole.twin.physics import film_field
from barberpole.twin.sensor_head import SensorHead

FIELD = (20.0, -30.0, 40.0)


def head_in(board, magnetisation=(1, 1, 1), faults=frozenset(), hidden=("none",), **changes):
    changes = {"ambient": Fixed(FIELD), "offset_mv_per_v": (0.0, 0.0, 0.0), "bias_ut": (0.0, 0.0, 0.0)} | changes
    return SensorHead(board, World.of(board, hidden, **changes), magnetisation, faults)


def bridges_ut(board, head, t_s=0.0):
    """Voltages of the three bridges as nominal fields in µT."""
    volts = head.volts(t_s)
    nominal = 1e-3 * board.sensor.sensitivity_mv_per_v_per_ut * board.sensor.bridge_v
    return np.array([volts[getattr(board.adc.channels, axis)] for axis in "xyz"]) / nominal


def test_ideal_bridge_reports_the_field_with_the_sign_of_its_state(board):
    head = head_in(board, (1, -1, 1), gain_spread=(1.0, 1.0, 1.0))
    assert bridges_ut(board, head) == pytest.approx([20.0, 30.0, 40.0])


def test_flipping_turns_the_field_and_the_bias_but_not_the_offset(board):
    head = head_in(board, bias_ut=(0.5, 0.5, 0.5), offset_mv_per_v=(0.3, 0.3, 0.3), gain_spread=(1.0, 1.0, 1.0))
    after_set = bridges_ut(board, head)
    head.magnetise(-1)
    after_reset = bridges_ut(board, head)
    assert (after_set - after_reset) / 2.0 == pytest.approx(np.array(FIELD) + 0.5)
    assert (after_set + after_reset) / 2.0 == pytest.approx(3 * [0.3 / board.sensor.sensitivity_mv_per_v_per_ut])


def test_each_die_feels_its_own_easy_axis(board):
    head = head_in(board, hidden=("cross_field",), gain_spread=(1.0, 1.0, 1.0))
    h_k = board.sensor.anisotropy_field_ut
    easy = ["xyz".index(axis) for axis in board.sensor.easy_axis]
    expected = [film_field(FIELD[i], FIELD[easy[i]], h_k[i], +1) for i in range(3)]
    assert bridges_ut(board, head) == pytest.approx(expected)
    assert expected != pytest.approx(FIELD, rel=1e-3)


def test_coil_acts_on_its_own_die_and_a_little_on_its_neighbours(board):
    head = head_in(board, gain_spread=(1.0, 1.0, 1.0), coil_spread=(1.0, 1.0, 1.0))
    at_rest = bridges_ut(board, head)
    head.drive(1, 0.5)
    full_ma = board.coils.full_scale_ma[1]
    field = bridges_ut(board, head) - at_rest
    assert field[1] == pytest.approx(0.5 * full_ma * board.sensor.offset_coil_ut_per_ma)
    assert 0.005 < abs(field[0] / field[1]) < 0.05
    assert 0.005 < abs(field[2] / field[1]) < 0.05
    shunt_v = head.volts(0.0)[board.adc.channels.coil_y]
    assert shunt_v == pytest.approx(0.5e-3 * full_ma * board.adc.coil_shunt_ohm)


def test_a_neighbours_coil_does_not_reach_the_easy_axis(board):
    """The cross-field of die x stays that of the ambient field while the y coil works (easy axis of x: y)."""
    no_stray = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    head = head_in(board, hidden=("cross_field",), coil_coupling=no_stray)
    at_rest = bridges_ut(board, head)
    head.drive(1, 0.9)
    assert bridges_ut(board, head)[0] == at_rest[0]


def test_broken_coils(board):
    whole, broken = head_in(board), head_in(board, faults=frozenset({"coil_open_x", "coil_short_y"}))
    for head in (whole, broken):
        for axis in range(3):
            head.drive(axis, 0.5)
    at_rest = bridges_ut(board, head_in(board))
    assert broken.current_ma[0] == 0.0
    resistors = board.coils.series_ohm + board.adc.coil_shunt_ohm
    assert broken.current_ma[1] / whole.current_ma[1] == pytest.approx(1.0 + board.sensor.offset_coil_ohm / resistors)
    field = bridges_ut(board, broken) - at_rest
    assert np.abs(field[:2]).max() < 0.05 * field[2]  # only the z coil's stray field


def test_temperature_shows_in_the_bridge_voltage_and_in_the_gain(board):
    cold = head_in(board, hidden=("sensitivity_temperature",), temperature=Constant(25.0))
    warm = head_in(board, hidden=("sensitivity_temperature",), temperature=Constant(45.0))
    ratio = warm.volts(0.0)[board.adc.channels.bridge] / cold.volts(0.0)[board.adc.channels.bridge]
    assert ratio == pytest.approx(1.0 + 20.0 * board.sensor.bridge_tempco_per_c)
    gain = bridges_ut(board, warm) / bridges_ut(board, cold)
    assert gain == pytest.approx(3 * [1.0 + 20.0 * board.sensor.sensitivity_tempco_per_c])


def test_misalignment_keeps_the_sensitivity(board):
    """Each sensitive axis is a unit vector: its largest reading in a field of 50 µT is 50 µT."""
    world = World.of(board, ("misalignment",), bias_ut=(0.0, 0.0, 0.0), gain_spread=(1.0, 1.0, 1.0))
    rows = np.eye(3) + np.array(world.misalignment_rad)
    for axis in range(3):
        field = 50.0 * rows[axis] / np.linalg.norm(rows[axis])
        head = head_in(board, hidden=("misalignment",), ambient=Fixed(tuple(field)), gain_spread=(1.0, 1.0, 1.0))
        assert bridges_ut(board, head)[axis] == pytest.approx(50.0)


def test_strong_backward_field_turns_a_die_over(board):
    h_k = board.sensor.anisotropy_field_ut[0]
    head = head_in(board, (1, 1, 1), hidden=("cross_field",), ambient=Fixed((10.0, -1.1 * h_k, 0.0)))
    head.volts(0.0)
    assert head.magnetisation[0] == -1


def test_truth_is_what_the_voltages_show(board):
    """Slope of the demodulated reading at zero field, in LSB, against truth()."""
    readings = []
    for level in (-0.5, 0.5):
        head = head_in(board, hidden=("cross_field", "flip_asymmetry"), ambient=Fixed((level, level, level)))
        after_set = bridges_ut(board, head)
        head.magnetise(-1)
        readings.append((after_set - bridges_ut(board, head)) / 2.0)
    truth = head.truth(0.0, lambda _: 0.0)
    slope = (readings[1] - readings[0]) * board.scale_lsb_per_ut
    assert slope == pytest.approx(truth["scale_lsb_per_ut"], rel=1e-6)  # (H / H_k)² at half a µT
    assert truth["parameters"]["gain_drift"] == (1.0, 1.0, 1.0)
    assert math.isfinite(truth["bias_lsb"][0])
