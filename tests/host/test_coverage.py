"""Intervals of 95 % hold the truth in 95 % of logs: a sample of what `make coverage` counts over 500 logs an effect."""

import numpy as np
import pytest
from truth.coverage import Case, count

LOGS = range(40)


def test_in_white_noise():
    """Twelve effects by forty logs by three parameters and more: the part held is known to 0.6 %."""
    effects = ("bias", "scale", "misalignment", "soft_iron", "cross_field", "quadratic", "saturation", "flip_asymmetry")
    effects += ("load_current", "bias_temperature", "drift", "mains", "outliers")
    found = [count(Case(name), LOGS) for name in effects]
    assert 0.93 < np.sum([f.held for f in found]) / np.sum([f.of for f in found]) < 0.97
    assert min(f.part for f in found) > 0.89


@pytest.mark.parametrize("name", ["bias", "quadratic", "bias_temperature"])
def test_in_noise_that_is_not_white(name):
    """Errors of white noise hold the truth of a bias in a fifth of such logs."""
    assert count(Case(name, coloured=True), LOGS).part > 0.88


def test_against_one_magnitude():
    assert count(Case("scale", reference="constant"), LOGS).part > 0.89
