"""Shields: the published recursions against the potentials solved exactly, in the limits where they must meet."""

from fractions import Fraction

import numpy as np
import pytest
from barberpole.design import shield
from barberpole.design.shield import CYLINDER, SPHERE, Shell, nested

MU = 11000.0


def single(inner_mm, thickness_mm):
    return nested(inner_mm, thickness_mm, 0.0, 1)


@pytest.mark.parametrize("thickness_mm", [0.1, 1.0, 50.0])
@pytest.mark.parametrize("mu", [10.0, 1e4, 1e6])
def test_sphere_is_exact(thickness_mm, mu):
    found = shield.sphere_factor(100.0, 100.0 + thickness_mm, mu)
    assert found == pytest.approx(shield.exact_factor(single(100.0, thickness_mm), mu, SPHERE), rel=1e-9)


@pytest.mark.parametrize("mu", [1e4, 1e6])
def test_one_cylinder_leaves_out_one_over_mu(mu):
    """F of one shell is exact but for eps / (2 mu)."""
    shells = single(100.0, 1.0)
    exact = shield.exact_factor(shells, mu)
    assert shield.cylinder_factor(shells, mu) == pytest.approx(exact, rel=1e-6)
    eps = 1 / 101 * (1 - 1 / 202)
    assert exact - shield.cylinder_factor(shells, mu) == pytest.approx(eps / (2 * mu), rel=1e-2)


def test_known_one_cylinder():
    """((mu + 1)^2 - (mu - 1)^2 a^2 / b^2) / (4 mu), the textbook's answer."""
    expected = ((MU + 1) ** 2 - (MU - 1) ** 2 * (100 / 101) ** 2) / (4 * MU)
    assert shield.exact_factor(single(100.0, 1.0), MU) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("layers", [2, 3, 4])
def test_many_cylinders_meet_in_the_limit(layers):
    """Thin walls and narrow gaps, mu t d constant: what the recursion leaves out falls with the gap."""
    errors = []
    for narrow in (Fraction(1, 10), Fraction(1, 100), Fraction(1, 10**7)):
        shells = nested(Fraction(100), 100 * narrow, 100 * narrow, layers)
        mu = 10 / narrow**2
        errors.append(abs(shield.cylinder_factor(shells, mu) / float(shield.exact_factor(shells, mu)) - 1))
    assert errors[0] > 5 * errors[1]
    assert errors[2] < 1e-6


def test_four_layers_as_built():
    """1 mm walls and 10 mm gaps around 200 mm: the recursion is too high by a few percent, the gap's share of it."""
    shells = nested(200.0, 1.0, 10.0, 4)
    assert 1.0 < shield.cylinder_factor(shells, MU) / shield.exact_factor(shells, MU) < 1.03


@pytest.mark.parametrize("shape", [CYLINDER, SPHERE])
def test_no_permeability_no_shield(shape):
    assert shield.exact_factor(nested(100.0, 1.0, 10.0, 4), 1.0, shape) == pytest.approx(1.0, rel=1e-12)


def test_shells_that_touch_are_one_shell():
    two = (Shell(101.0, 1.0, 0.0), Shell(102.0, 1.0, 0.0))
    assert shield.exact_factor(two, MU) == pytest.approx(shield.exact_factor(single(100.0, 2.0), MU), rel=1e-12)


def test_what_helps():
    """Appendix B.2-B.4: a smaller radius, wider gaps, more layers, and a sphere."""

    def factor(inner=200.0, gap=10.0, layers=4, shape=CYLINDER):
        return shield.exact_factor(nested(inner, 1.0, gap, layers), MU, shape)

    assert factor(inner=100.0) > factor()
    assert factor(gap=30.0) > factor()
    assert list(np.sort([factor(layers=n) for n in range(1, 5)])) == [factor(layers=n) for n in range(1, 5)]
    assert factor(shape=SPHERE) > factor()


def test_decibel():
    assert shield.decibel(1000.0) == pytest.approx(60.0)
