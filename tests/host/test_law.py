"""The published law of the bridge against the film solved exactly, and its own equations against each other."""

import numpy as np
import pytest
from barberpole.effects import film as exact
from barberpole.law import film, reading, supply
from scipy.optimize import minimize_scalar

H_K_UT = 800.0
SMALL_UT = 0.8  # of H_k: 1e-3, so that a term of third order is 1e-9
H_E_UT = np.linspace(-300.0, 300.0, 13)
BRIDGE = supply.Bridge(1100.0, 1103.0, 1098.0, 1101.0, 0.0025)
CURRENT_A = 5e-3


def slope(function, at, step=1e-4):
    return (function(at + step) - function(at - step)) / (2 * step)


def test_small_angle_is_the_minimum_of_the_energy():
    for h_e_ut in (-200.0, 0.0, 150.0):
        found = minimize_scalar(
            film.energy, bracket=(-0.1, 0.1), args=(SMALL_UT, h_e_ut, H_K_UT), options={"xtol": 1e-12}
        )
        assert found.x == pytest.approx(film.small_angle(SMALL_UT, h_e_ut, H_K_UT), rel=1e-4)


def test_bridge_meets_the_film_for_small_fields():
    """The exact film of the effects and 3.13 differ by a term of third order in H_s / H_k."""
    tangent = exact.tilt(np.full_like(H_E_UT, SMALL_UT), H_E_UT, 1.0 / H_K_UT)
    whole = tangent / (1.0 + tangent**2)  # sin(phi) cos(phi)
    np.testing.assert_allclose(film.bridge(SMALL_UT, H_E_UT, H_K_UT), whole, rtol=1e-5)


def test_barber_poles_make_the_bridge():
    """3.9 and 3.10 in 3.11 give 3.12; the mean leg is R (1 - dR/2R) at any field."""
    ratio = 0.02
    plus, minus = (film.barber_pole(50.0, H_E_UT, H_K_UT, ratio, sign) for sign in (1, -1))
    output = (minus - plus) / (plus + minus)
    np.testing.assert_allclose(output, ratio / (1.0 - ratio / 2) * film.bridge(50.0, H_E_UT, H_K_UT), rtol=1e-13)
    np.testing.assert_allclose(plus + minus, 2.0 - ratio, rtol=1e-15)


def test_plain_strip_is_even_and_saturates():
    assert film.resistance(50.0, 0.0, H_K_UT, 0.02) == film.resistance(-50.0, 0.0, H_K_UT, 0.02)
    assert film.resistance(2 * H_K_UT, 0.0, H_K_UT, 0.02) == pytest.approx(0.98)


def test_series_of_the_flipped_bridge():
    """3.34 leaves out x^5 / 8 of each state."""
    h_s_ut = np.linspace(-100.0, 100.0, 9)
    x = np.max(np.abs(film.small_angle(h_s_ut, -300.0, H_K_UT)))
    left_out = film.flipped_series(h_s_ut, H_E_UT[:, None], H_K_UT) - film.flipped(h_s_ut, H_E_UT[:, None], H_K_UT)
    assert np.max(np.abs(left_out)) < 1.1 * x**5 / 8


def test_series_without_cross_field():
    h_s_ut = np.linspace(-100.0, 100.0, 9)
    np.testing.assert_allclose(
        film.flipped_series(h_s_ut, 0.0, H_K_UT), film.flipped_without_cross_field(h_s_ut, H_K_UT), rtol=1e-14, atol=0
    )


def test_reset_turns_the_sign():
    assert film.bridge_reset(30.0, 0.0, H_K_UT) == -film.bridge(30.0, 0.0, H_K_UT)
    assert film.bridge_reset(30.0, 40.0, H_K_UT) == pytest.approx(-film.bridge(30.0, -40.0, H_K_UT), rel=1e-15)


def test_linear_law_is_the_limit():
    np.testing.assert_allclose(
        film.bridge_linear(SMALL_UT, H_E_UT, H_K_UT), film.bridge(SMALL_UT, H_E_UT, H_K_UT), rtol=2e-6
    )


@pytest.mark.parametrize("h_s_ut", [20.0, 100.0, -100.0])
def test_cross_slope_is_the_derivative(h_s_ut):
    found = slope(lambda h_e_ut: film.bridge(h_s_ut, h_e_ut, H_K_UT), H_E_UT, 1e-2)
    np.testing.assert_allclose(film.cross_slope(h_s_ut, H_E_UT, H_K_UT), found, rtol=1e-6)


def test_printed_slope_belongs_to_another_law():
    """5.2 is the derivative of x sqrt(1 + x^2); with 5.1 it agrees only to first order in x."""

    def other(h_e_ut):
        x = film.small_angle(100.0, h_e_ut, H_K_UT)
        return x * np.sqrt(1 + x**2)

    np.testing.assert_allclose(film.cross_slope_printed(100.0, H_E_UT, H_K_UT), slope(other, H_E_UT, 1e-2), rtol=1e-6)
    ratio = film.cross_slope_printed(SMALL_UT, 0.0, H_K_UT) / film.cross_slope(SMALL_UT, 0.0, H_K_UT)
    assert ratio == pytest.approx(1.0, abs=1e-5)


def test_flipping_and_a_stiffer_film_both_lower_the_error():
    """Fig. 3.6, 3.8 and 5.3: the error falls with H_k, and flipping takes the odd part away."""
    soft, stiff = (np.max(np.abs(reading.reading_error_ut(100.0, H_E_UT, h_k))) for h_k in (800.0, 2000.0))
    flipped = reading.reading_error_ut(100.0, H_E_UT, 800.0, flipping=True)
    assert stiff < soft / 2
    assert np.max(np.abs(flipped)) < soft / 3
    np.testing.assert_allclose(flipped, flipped[::-1], rtol=1e-12)
    assert reading.reading_error_ut(0.0, 300.0, 800.0) == 0.0


def test_compass_error_to_first_order():
    """With k = B / H_k: error = k sin cos (sin - cos) for a small k."""
    heading = np.linspace(0.0, 2 * np.pi, 73)
    found = reading.compass_error_rad(0.1, H_K_UT, heading)
    k, sin, cos = 0.1 / H_K_UT, np.sin(heading), np.cos(heading)
    np.testing.assert_allclose(found, k * sin * cos * (sin - cos), atol=3 * k**2)
    flipped = reading.compass_error_rad(0.1, H_K_UT, heading, flipping=True)
    assert np.max(np.abs(flipped)) < 2 * k**2


def test_offset_on_a_voltage_does_not_drift():
    warm = np.array([-40.0, 0.0, 60.0])
    cold = supply.offset_on_voltage_v(BRIDGE, 5.0)
    rounding = 4 * np.finfo(float).eps * 5.0  # of the difference of two halves of the supply
    np.testing.assert_allclose(supply.offset_on_voltage_v(BRIDGE, 5.0, warm), cold, rtol=0, atol=rounding)


def test_offset_on_a_current_is_that_on_its_own_voltage():
    """3.23 against 3.15: the current makes the voltage I R_eq."""
    voltage = CURRENT_A * BRIDGE.equivalent_ohm
    found = supply.offset_on_current_v(BRIDGE, CURRENT_A)
    assert found == pytest.approx(supply.offset_on_voltage_v(BRIDGE, voltage), rel=1e-12)


def test_drifts_are_slopes():
    offset = slope(lambda warm: supply.offset_on_current_v(BRIDGE, CURRENT_A, warm), 20.0)
    assert supply.offset_drift_on_current_v_per_k(BRIDGE, CURRENT_A) == pytest.approx(offset, rel=1e-8)
    sensitivity = slope(lambda warm: supply.sensitivity_on_voltage(BRIDGE, warm), 2.0)
    left_out = 3 * BRIDGE.alpha_per_k**3 * 2.0**2
    assert supply.sensitivity_drift_on_voltage_per_k(BRIDGE, 2.0) == pytest.approx(sensitivity, abs=1.1 * left_out)


def test_flipping_takes_offset_and_its_drift():
    bridge = supply.unbalanced(1100.0, 4.0, 0.0025)
    printed = CURRENT_A * 1100.0 * 4.0 / (4 * 1100.0 + 4.0)  # 3.37 without field
    after_set, after_reset = supply.set_and_reset_v(bridge, CURRENT_A, 0.0)
    assert after_set == after_reset == pytest.approx(printed, rel=1e-12)
    drift = slope(lambda warm: supply.set_and_reset_v(bridge, CURRENT_A, 2.0, warm)[0], 0.0)
    assert drift == pytest.approx(0.0025 * printed, rel=1e-8)  # 3.42
    warm = np.array([-40.0, 0.0, 60.0])
    np.testing.assert_allclose(supply.demodulated_v(bridge, CURRENT_A, 2.0, warm), -CURRENT_A * 2.0, rtol=1e-12)


def test_shape_anisotropy_needs_a_short_side():
    assert film.shape_anisotropy_ut(1.0, 10.0, 10.0, 1e6, 50.0) == -50.0
    assert film.shape_anisotropy_ut(1.0, 10.0, 1e9, 1e6, 50.0) == pytest.approx(1e5 - 50.0)
