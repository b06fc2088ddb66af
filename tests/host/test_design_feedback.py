"""Feedback operation: what the loop gains and what it costs."""

import numpy as np
import pytest
from barberpole.design import feedback
from barberpole.design.feedback import OffsetCoil
from barberpole.law.reading import reading_error_ut, reading_ut

H_K_UT = 800.0
H_E_UT = np.linspace(-200.0, 200.0, 9)


def test_coil_nulls_what_the_bridge_sees():
    coil = feedback.coil_field_ut(100.0, H_E_UT, H_K_UT, 1e6)
    np.testing.assert_allclose(coil, 100.0, rtol=2e-6)


def test_loop_is_closed():
    coil = feedback.coil_field_ut(100.0, H_E_UT, H_K_UT, 50.0)
    np.testing.assert_allclose(coil, 50.0 * reading_ut(100.0 - coil, H_E_UT, H_K_UT), rtol=1e-12)


@pytest.mark.parametrize("loop_gain", [10.0, 100.0])
def test_error_falls_with_the_loop_gain(loop_gain):
    """To first order the error is that of a sensor that sees H_s / (1 + G), times the loop's own share."""
    bare = np.max(np.abs(reading_error_ut(100.0, H_E_UT, H_K_UT)))
    looped = np.max(np.abs(feedback.feedback_reading_ut(100.0, H_E_UT, H_K_UT, loop_gain) - 100.0))
    assert looped < 1.1 * bare / (1.0 + loop_gain)


def test_no_loop_is_the_bare_slope():
    slope = (reading_ut(100.0, 50.01, H_K_UT) - reading_ut(100.0, 49.99, H_K_UT)) / 0.02
    assert feedback.cross_sensitivity(100.0, 50.0, H_K_UT) == pytest.approx(slope, rel=1e-6)
    assert abs(feedback.cross_sensitivity(100.0, 50.0, H_K_UT, 100.0)) < abs(slope) / 90


def test_power_two_ways():
    """The coil's share of what the supply gives is its voltage over the supply's."""
    coil = OffsetCoil("a", 50.0, 0.046)
    voltage = coil.resistance_ohm * coil.ma_per_ut * 1e-3 * 50.0
    assert feedback.coil_power_mw(coil, 50.0) == pytest.approx(
        feedback.supply_power_mw(coil, 50.0, 5.0) * voltage / 5.0
    )
    assert feedback.coil_power_mw(coil, -50.0) == feedback.coil_power_mw(coil, 50.0)
