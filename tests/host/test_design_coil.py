"""Helmholtz coil: magpylib, the closed form on the axis and the integral off it, to 1e-6 and better."""

import numpy as np
import pytest
from barberpole.design import coil
from barberpole.design.coil import CoilPair
from barberpole.errors import LimitError

PAIR = CoilPair(100.0, 60)
CENTRE_MM = np.zeros((1, 3))


def test_centre_is_the_known_constant():
    """(4/5)^(3/2) mu0 n I / R."""
    expected = 0.8**1.5 * 4e-7 * np.pi * 60 * 0.085 / 0.1 * 1e6
    assert coil.axis_field_ut(PAIR, 85.0, 0.0) == pytest.approx(expected, rel=1e-12)
    assert 85.0 * coil.constant_ut_per_ma(PAIR) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("spacing_mm", [None, 80.0, 130.0])
def test_magpylib_on_the_axis(spacing_mm):
    pair = CoilPair(100.0, 60, spacing_mm)
    x_mm = np.linspace(-70.0, 70.0, 15)
    found = coil.field_ut(pair, 85.0, np.stack([x_mm, 0 * x_mm, 0 * x_mm], axis=1))
    np.testing.assert_allclose(found[:, 0], coil.axis_field_ut(pair, 85.0, x_mm), rtol=1e-9)
    np.testing.assert_allclose(found[:, 1:], 0.0, atol=1e-9)


def test_magpylib_off_the_axis_is_the_integral():
    """A.3 for each loop; the trapezoidal rule on a circle converges as a geometric series."""
    rng = np.random.default_rng(1)
    for x_mm, y_mm in rng.uniform(-40.0, 40.0, (6, 2)):
        whole = sum(coil.loop_field_ut(100.0, 60, 85.0, x_mm - side * 50.0, y_mm) for side in (-1, 1))
        found = coil.field_ut(PAIR, 85.0, np.array([[x_mm, y_mm, 0.0]]))[0]
        np.testing.assert_allclose(found[:2], whole, rtol=1e-9, atol=1e-9)
        assert found[2] == pytest.approx(0.0, abs=1e-9)


def test_printed_second_loop_spoils_the_plane_of_symmetry():
    """Half way between the loops the field has no y component; with A.5 as printed it would have."""
    first, second = (coil.loop_field_ut(100.0, 60, 85.0, x_mm, 20.0) for x_mm in (50.0, -50.0))
    assert (first + second)[1] == pytest.approx(0.0, abs=1e-12)
    assert abs(first[1]) > 1.0


def test_helmholtz_is_flat_to_fourth_order():
    """On the axis B / B0 = 1 - 144/125 (x/R)^4 to leading order."""
    drop = 1.0 - coil.axis_field_ut(PAIR, 1.0, 2.0) / coil.axis_field_ut(PAIR, 1.0, 0.0)
    assert drop == pytest.approx(144 / 125 * 0.02**4, rel=1e-2)


def test_tilt_of_one_loop():
    """Each loop gives half the field at the centre; a small tilt turns one half, and the pair by half of it."""
    tilted = CoilPair(100.0, 60, tilt_rad=np.deg2rad(1.0))
    assert coil.direction_error_rad(PAIR) == pytest.approx(0.0, abs=1e-12)
    own = coil.field_ut(tilted, 1.0, CENTRE_MM)[0] - coil.field_ut(PAIR, 1.0, CENTRE_MM)[0]
    assert np.linalg.norm(own) > 0
    assert coil.largest_deviation(tilted, 10.0) > 5 * coil.largest_deviation(PAIR, 10.0)


def test_tilted_loop_against_the_law_of_biot_and_savart():
    """A.6: the loop's elements turned by R(alpha), summed directly."""
    tilt, steps = np.deg2rad(10.0), 2000
    pair = CoilPair(100.0, 1, tilt_rad=tilt)
    phi = 2 * np.pi * np.arange(steps) / steps
    flat = np.stack([0 * phi, 100.0 * np.cos(phi), 100.0 * np.sin(phi)], axis=1)
    along = np.stack([0 * phi, -np.sin(phi), np.cos(phi)], axis=1) * 100.0 * 2 * np.pi / steps
    cos, sin = np.cos(tilt), np.sin(tilt)
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    point = np.array([7.0, -5.0, 3.0])
    total = np.zeros(3)
    for centre_x, matrix in ((-50.0, np.eye(3)), (50.0, turn)):
        reach = point - (flat @ matrix.T + [centre_x, 0, 0])
        terms = np.cross(along @ matrix.T, reach) / np.linalg.norm(reach, axis=1, keepdims=True) ** 3
        total += coil.MU0_UT_MM_PER_MA / (4 * np.pi) * terms.sum(axis=0)
    np.testing.assert_allclose(coil.field_ut(pair, 1.0, point.reshape(1, 3))[0], total, rtol=1e-9)


def test_uniform_region_has_the_deviation_asked_for():
    half_mm = coil.uniform_half_side_mm(PAIR, 1e-3)
    assert coil.largest_deviation(PAIR, half_mm) == pytest.approx(1e-3, rel=1e-3)
    assert coil.radius_for_region_mm(half_mm, 1e-3) == pytest.approx(100.0, rel=1e-6)


def test_larger_coil_for_the_same_tilt():
    """Fig. A.10: with 1 degree of error the deviation over the same square falls with the radius."""
    one = np.deg2rad(1.0)
    found = [coil.largest_deviation(CoilPair(r, 1, tilt_rad=one), 10.0) for r in (100.0, 200.0, 300.0, 400.0)]
    assert found == sorted(found, reverse=True)
    with pytest.raises(LimitError, match="the tolerance must be between"):
        coil.uniform_half_side_mm(CoilPair(100.0, 1, tilt_rad=one), 1e-9)


def test_currents_undo_the_angles_between_the_coils():
    constants = np.diag([0.5, 0.6, 0.7]) + 0.01 * np.arange(9).reshape(3, 3)
    wanted = np.array([[20.0, -30.0, 40.0], [1.0, 0.0, 0.0]])
    np.testing.assert_allclose(coil.currents_ma(wanted, constants) @ constants.T, wanted, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(coil.currents_ma(wanted, np.array([0.5, 0.6, 0.7]))[1], [2.0, 0.0, 0.0])


def test_power():
    assert coil.resistive_power_mw(70.0, 100.0) == pytest.approx(700.0)
