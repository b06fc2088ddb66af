"""Which forms of an effect are tried on a log, and how large each may be: where a diagnosis begins."""

import numpy as np
import pytest
from barberpole.effects import STACK, Conditions, Setup, find_effect


def test_an_effect_with_a_frequency_of_its_own_is_tried_once_that_is_known():
    mains = find_effect("mains")
    assert mains.forms(Setup(duration_s=1.0, interval_s=0.01)) == ()
    assert len(mains.forms(Setup({"frequency_hz": 17.0}, duration_s=1.0, interval_s=0.01))) == 1
    t = np.arange(600) / 100.0
    residual = np.random.default_rng(1).normal(size=(3, 600)) + 1.5 * np.sin(2 * np.pi * 17.3 * t)
    (form,) = mains.search(Setup(duration_s=6.0, interval_s=0.01), Conditions(state=0.0, t_s=t), residual, residual)
    assert form.inner["frequency"] == pytest.approx(17.3, abs=0.05)
    assert form.settings["frequency_hz"] == form.inner["frequency"]
    assert form.tried > 100  # that many were looked at, which its evidence pays for


def test_a_lag_is_tried_below_and_above_the_time_step():
    sizes = [shape.secant for shape in find_effect("lag").forms(Setup(duration_s=9.0, interval_s=0.01))]
    assert sizes == sorted(sizes)
    assert sizes[0] <= 1.0 < 10.0 <= sizes[-1]


def power_of_lsb(unit):
    """Of LSB in a unit such as LSB/K or 1/LSB^2."""
    above, _, below = unit.partition("/")
    return above.count("LSB") - (int((below.partition("LSB^")[2] or "1")[0]) if "LSB" in below else 0)


@pytest.mark.parametrize("effect", STACK, ids=lambda effect: effect.name)
@pytest.mark.parametrize("reference", ["vector", "constant"])
def test_sizes_follow_the_units_of_the_readings(effect, reference):
    """A sensor of ten times the LSB per µT has the same effects, in other numbers."""
    setup = {"reference": reference, "flipping": "raw", "span_ut": 75.0, "duration_s": 4.0, "interval_s": 0.01}
    plain, finer = (effect.params(Setup(lsb_per_ut=lsb, **setup)) for lsb in (3.0, 30.0))
    for one, other in zip(plain, finer, strict=True):
        if one.inner:
            continue
        times = 10.0 ** power_of_lsb(one.unit)
        assert other.typical == pytest.approx(times * one.typical, rel=1e-9), one.name
        assert other.first == pytest.approx(times * one.first, rel=1e-9), one.name
        if one.unit != "LSB/uT":  # a gain has wide bounds that fit any sensor
            assert [other.lower, other.upper] == pytest.approx([times * one.lower, times * one.upper]), one.name
