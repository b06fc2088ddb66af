"""The film's law in the limits where its answer is known, and against its own energy."""

import math

import numpy as np
import pytest
from barberpole.twin.physics import domain_angle, energy, film_field, sinc3_step, turns_over

H_K = 800.0
FIELDS = [(a, e) for a in (-240.0, -50.0, -0.3, 0.0, 7.0, 100.0, 300.0) for e in (-200.0, -40.0, 0.0, 15.0, 250.0)]


@pytest.mark.parametrize(("across", "along"), FIELDS)
def test_angle_is_an_energy_minimum(across, along):
    """The one on this side: in a backward field the other side lies lower."""
    angle = domain_angle(across, along, H_K)
    angles = angle + np.linspace(-0.5, 0.5, 4001)
    best = angles[np.argmin([energy(float(a), across, along, H_K) for a in angles])]
    assert abs(best - angle) <= 1.0 / 4000  # one step of the grid


@pytest.mark.parametrize(("across", "along"), FIELDS)
def test_angle_solves_the_torque_balance(across, along):
    angle = domain_angle(across, along, H_K)
    torque = H_K * math.sin(angle) * math.cos(angle) - across * math.cos(angle) + along * math.sin(angle)
    assert abs(torque) < 1e-11  # rounding of terms of 1e3


@pytest.mark.parametrize(("across", "along"), FIELDS)
def test_set_and_reset_mirror_each_other(across, along):
    assert film_field(across, along, H_K, -1) == film_field(across, -along, H_K, +1)
    assert film_field(-across, along, H_K, +1) == pytest.approx(-film_field(across, along, H_K, +1), abs=1e-12)


def test_no_field_along_the_easy_axis_has_a_closed_form():
    for across in (-700.0, -1.0, 0.0, 30.0, 500.0):
        closed = across * math.sqrt(1.0 - (across / H_K) ** 2)  # sin(phi) = H_a / H_k
        assert film_field(across, 0.0, H_K, +1) == pytest.approx(closed, abs=1e-11)


def test_stiff_film_reports_the_field():
    assert film_field(50.0, 40.0, 1e12, +1) == pytest.approx(50.0, rel=1e-9)
    assert film_field(50.0, 40.0, math.inf, -1) == 50.0


@pytest.mark.parametrize("along", [-120.0, 0.0, 60.0])
def test_slope_at_zero_field(along):
    """d f / d H_a = H_k / (H_k + s H_e): thesis 3.14 is exact there."""
    step = 1e-3
    for state in (+1, -1):
        slope = (film_field(step, along, H_K, state) - film_field(-step, along, H_K, state)) / (2.0 * step)
        assert slope == pytest.approx(H_K / (H_K + state * along), rel=1e-9)


def test_small_fields_follow_the_published_series():
    """(3.13) with (3.4), in the field where its terms of third order are below 1e-6 of the reading."""
    across, along = 2.0, 1.0
    ratio = across / (H_K + along)
    assert film_field(across, along, H_K, +1) == pytest.approx(H_K * ratio, rel=2e-5)


def test_only_a_backward_field_outside_the_astroid_turns_the_film_over():
    assert not turns_over(0.0, 2.0 * H_K, H_K, +1)
    assert turns_over(0.0, -1.01 * H_K, H_K, +1)
    assert not turns_over(0.0, -0.99 * H_K, H_K, +1)
    assert turns_over(0.0, 1.01 * H_K, H_K, -1)
    corner = H_K / 2.0**1.5  # |H_a| = |H_e| on the astroid
    assert turns_over(1.01 * corner, -1.01 * corner, H_K, +1)
    assert not turns_over(0.99 * corner, -0.99 * corner, H_K, +1)


def test_filter_step_is_the_integral_of_three_averages():
    """A sinc3 is three running means in a row; done numerically on a fine grid."""
    fine = 400
    step = np.concatenate([np.zeros(3 * fine), np.ones(4 * fine)])
    for _ in range(3):
        step = np.convolve(step, np.full(fine, 1.0 / fine))[: step.size]
    for periods in (0.25, 0.5, 1.0, 1.4, 2.0, 2.7, 3.0):
        measured = step[3 * fine - 1 + round(periods * fine)]
        assert sinc3_step(periods) == pytest.approx(measured, abs=2.0 / fine)  # the grid is discrete
    assert sinc3_step(-0.1) == 0.0
    assert sinc3_step(3.5) == 1.0
