"""The fit: known parameters come back, what a log cannot carry is refused or named, held-out errors are honest."""

import numpy as np
import pytest
from barberpole.challenge.record import Recipe, record
from barberpole.errors import InputError
from barberpole.fit.ellipsoid import algebraic
from barberpole.fit.fit import Fit, fit_log
from truth.trials import BASE, log_of, model_of

NOISE_LSB = 2.0  # of every recipe here: 0.2 µT at 10 LSB/µT


def fitted(columns: dict, *more: str) -> Fit:
    return fit_log(log_of(columns), model_of((*BASE, *more)))


@pytest.mark.parametrize("reference", ["vector", "magnitude", "constant"])
@pytest.mark.parametrize("form", ["flips", "demodulated", "pairs"])
def test_nothing_hidden_leaves_noise(reference, form):
    fit = fitted(record(Recipe({}, reference=reference, form=form, seed=1)))
    assert fit.converged
    assert fit.rms_lsb == pytest.approx(NOISE_LSB, rel=0.05)  # 3000 residuals: 1.3 % standard error
    assert fit.rms_lsb < fit.heldout_rms_lsb < 1.02 * fit.rms_lsb
    assert fit.unobservable == ()


def test_magnitude_gives_the_scale_that_the_vector_gives():
    by_vector = fitted(record(Recipe({}, seed=2)))
    by_magnitude = fitted(record(Recipe({}, reference="magnitude", seed=2)))
    for axis in "xyz":
        at_v, at_m = (f.model.names.index(f"scale.{axis}") for f in (by_vector, by_magnitude))
        apart = by_vector.p[at_v] - by_magnitude.p[at_m]
        assert abs(apart) < 5 * np.hypot(by_vector.stderr[at_v], by_magnitude.stderr[at_m])


def test_standard_errors_hold_in_repetition():
    """z-scores of the biases of 30 logs: their mean square is 1 within a factor that 90 of them allow."""
    z = []
    for seed in range(30):
        recipe = Recipe({}, rows=600, seed=seed)
        fit = fitted(record(recipe))
        rng = np.random.default_rng(recipe.seed + 10_000_000)
        rng.normal(size=(3, 600)), rng.uniform(0.85, 1.15, 3)  # as record() drew before the bias
        bias = 10.0 * rng.uniform(-15, 15, 3)
        at = [fit.model.names.index(f"bias.{a}") for a in "xyz"]
        z += list((fit.p[at] - bias) / fit.stderr[at])
    assert 0.7 < np.mean(np.square(z)) < 1.4


@pytest.mark.parametrize("scale", [0.3, 10_000.0])
def test_units_do_not_matter(scale):
    one = fitted(record(Recipe({"cross_field": 1.0}, seed=3, lsb_per_ut=1.0)), "cross_field")
    other = fitted(record(Recipe({"cross_field": 1.0}, seed=3, lsb_per_ut=scale)), "cross_field")
    assert other.rms_lsb / scale == pytest.approx(one.rms_lsb, rel=1e-5)  # the same draw, so the same minimum


def test_six_samples_are_refused():
    few = {name: values[::500] for name, values in record(Recipe({}, reference="constant")).items()}
    with pytest.raises(InputError, match="at least 12 samples"):
        fitted(few)


def test_a_planar_turn_is_refused():
    with pytest.raises(InputError, match="turn it through all directions"):
        fitted(record(Recipe({}, reference="constant", planar=True)))


def test_a_planar_turn_in_a_known_field_names_what_is_missing():
    assert set(fitted(record(Recipe({}, planar=True))).unobservable) & {"bias.z", "scale.z", "bias.x", "scale.x"}


def test_a_small_tilt_is_ill_conditioned():
    rng, n = np.random.default_rng(4), 3000
    x, y = np.radians(10) * np.sin(np.linspace(0, 40, n)), np.radians(10) * np.sin(np.linspace(0, 57, n))
    reading = 500 * np.stack([np.sin(x), np.sin(y) * np.cos(x), np.cos(y) * np.cos(x)]) + 2 * rng.normal(size=(3, n))
    assert fitted({f"{a}_lsb": reading[i] for i, a in enumerate("xyz")}).condition > 30


def test_spikes_are_survived_with_the_robust_loss():
    columns = record(Recipe({}, seed=5))
    rng = np.random.default_rng(5)
    for a in "xyz":
        columns[f"{a}_lsb"] = columns[f"{a}_lsb"] + 400.0 * (rng.random(3000) < 0.005)
    plain, robust = fitted(columns), fitted(columns, "outliers")
    assert plain.rms_lsb > 10 * NOISE_LSB
    assert robust.rms_lsb == pytest.approx(NOISE_LSB, rel=0.05)


def test_a_column_that_an_effect_needs_is_asked_for():
    columns = record(Recipe({}))
    del columns["temp_c"]
    with pytest.raises(InputError, match="temp_c"):
        fitted(columns, "bias_temperature")


def test_the_algebraic_ellipsoid_is_exact_without_noise():
    rng = np.random.default_rng(6)
    upper, centre = np.array([[1.1, 0.1, -0.2], [0, 0.9, 0.05], [0, 0, 1.2]]), np.array([[3.0], [-2.0], [5.0]])
    u = rng.normal(size=(3, 40))
    found = algebraic(np.linalg.solve(upper, u / np.linalg.norm(u, axis=0)) + centre)
    np.testing.assert_allclose(found.upper, upper, atol=1e-10)  # rounding, times a condition number of about 100
    np.testing.assert_allclose(found.centre, centre[:, 0], atol=1e-10)


def test_effects_that_say_the_same_are_frozen_and_named_and_the_fit_stays_on_course():
    columns = record(Recipe({}, seed=3))
    one, both = fitted(columns), fitted(columns, "soft_iron")
    assert both.converged
    assert set(both.unobservable) == {"soft_iron.xy", "soft_iron.xz", "soft_iron.yz"}
    assert both.heldout_rms_lsb == pytest.approx(one.heldout_rms_lsb, rel=1e-6)


def test_a_strong_saturation_shows_through_heavy_noise():
    """Its standard error is several times what a clean sensor shows, and its value many standard errors."""
    log = log_of(record(Recipe({"saturation": 1.0}, noise_ut=2.0, form="demodulated", seed=4_000_501)))
    fit = fit_log(log, model_of((*BASE, "saturation")))
    assert fit.rms_lsb < 1.02 * 20.0 * 1.08  # the gains of that sensor are up to 8 % above the ten of the recipe
    assert all(value > 0 for name, value in zip(fit.model.names, fit.p, strict=True) if "saturation" in name)


@pytest.mark.parametrize("reference", ["vector", "magnitude", "constant"])
def test_a_bridge_offset_many_times_the_field_is_no_obstacle(reference):
    """It alternates with the flips: in readings of raw polarity a scalar log lies on two ellipsoids."""
    columns = record(Recipe({}, form="pairs", reference=reference, seed=77))
    for axis, offset in zip("xyz", (30_000.0, -12_000.0, 25_000.0), strict=True):
        columns[f"{axis}_set_lsb"] += offset
        columns[f"{axis}_reset_lsb"] += offset
    fit = fit_log(log_of(columns), model_of(BASE))
    assert fit.rms_lsb == pytest.approx(2.0, rel=0.12)  # the noise, through gains of up to 15 %
    assert fit.p[fit.model.names.index("bias.bridge_y")] == pytest.approx(-12_000.0, abs=1.0)
