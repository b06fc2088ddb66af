"""The short ways through a fit give what the long ways give: moments, sums of neighbours, some samples for all."""

from dataclasses import replace

import numpy as np
import pytest
from barberpole.challenge.record import Recipe, record
from barberpole.errors import InputError
from barberpole.fit import residual
from barberpole.fit.affine import moments
from barberpole.fit.few import ENOUGH, few
from barberpole.fit.fit import Fit, fit_log, fit_observations
from barberpole.fit.gram import accumulate, solve_scaled
from barberpole.fit.honest import factors
from barberpole.fit.usable import require_one_field
from bench.data import turned
from truth.trials import BASE, log_of, model_of


def fitted(reference: str) -> Fit:
    return fit_log(log_of(record(Recipe({}, 1203, reference, "demodulated", seed=5))), model_of(BASE))


@pytest.mark.parametrize("reference", ["vector", "magnitude", "constant"])
def test_residuals_in_one_product_are_those_sample_by_sample(reference):
    fit = fitted(reference)
    problem, p = fit.problem, fit.p * 1.001
    one_by_one = np.concatenate([problem.residual_of(p, rows) for rows in problem.chunks()], axis=1)
    assert problem.affine
    assert np.allclose(problem.residual(p), one_by_one, rtol=0.0, atol=1e-9)


def test_sums_of_neighbours_need_no_residual():
    fit = fitted("vector")
    summed, squares = fit.problem.neighbours(fit.p)
    left = fit.problem.residual(fit.p)
    assert summed.shape == (3, left.shape[1] // 8)
    assert np.allclose(summed[:, 7], left[:, 56:64].sum(axis=1), atol=1e-8)
    assert np.allclose(squares, np.sum(left**2, axis=1), rtol=1e-9)
    by_residual = replace(fit.problem, moments=None).neighbours(fit.p)
    assert np.allclose(summed, by_residual[0], atol=1e-8)
    assert np.allclose(squares, by_residual[1], rtol=1e-9)


@pytest.mark.parametrize("noise_lsb", [0.3, 1.5, 3.0])
@pytest.mark.parametrize("n", [300, 10_000])
def test_a_last_step_without_a_pass_ends_where_another_would(monkeypatch, n, noise_lsb):
    """Noise of 0.2, 1 and 2 % of the field; a hundredth of a standard error is promised, of the noise too."""
    seen = turned(n, "constant")
    loud = replace(seen, y=seen.y + noise_lsb * np.random.default_rng(n).normal(size=seen.y.shape))
    short = fit_observations(loud, model_of(BASE))
    monkeypatch.setattr(residual, "NEAR", 0.0)
    long = fit_observations(loud, model_of(BASE))
    assert short.converged
    assert np.max(np.abs(short.p - long.p) / long.stderr) < 0.01
    assert short.rms_lsb == pytest.approx(long.rms_lsb, rel=0.01 / np.sqrt(2 * n))


def test_moments_give_the_normal_equations_of_a_pass():
    fit = fitted("vector")
    p = fit.p * 1.01
    short, long = fit.problem.gram(p), accumulate(fit.problem, p)
    assert np.allclose(short.jj, long.jj, rtol=1e-9, atol=1e-9 * np.abs(long.jj).max())
    assert np.allclose(short.jr, long.jr, rtol=1e-7, atol=1e-9 * np.abs(long.jr).max())
    assert np.allclose(short.rr, long.rr)


@pytest.mark.parametrize("thin", [1.0, 2e-3, 5e-4, 0.0])
def test_a_field_spans_where_its_smallest_extent_does(thin):
    b = turned(2000, "vector").b_ut * np.array([[1.0], [1.0], [thin]]) + 20.0
    assert moments(b, b).spans(1e-3) == (np.linalg.svd(np.cov(b), compute_uv=False)[2] > 1e-6 * np.cov(b)[0, 0])


@pytest.mark.parametrize("n", [ENOUGH, ENOUGH + 1, 2 * ENOUGH, 24 * ENOUGH, 1_000_003])
def test_few_samples_stand_for_all_whatever_the_period(n):
    """A log of 24 orientations over and over shows all of them, each as often as the others within a third."""
    places = np.arange(n)[few(n)]
    assert places.size == ENOUGH
    assert np.all(np.diff(places) >= 0)
    assert 0 <= places[0] < places[-1] < n
    often = np.bincount(places % 24, minlength=24)
    assert often.min() > ENOUGH / 24 / 1.5
    assert often.max() < ENOUGH / 24 * 1.5


def test_a_step_at_the_edge_is_not_lost_by_looking_at_few():
    """The least step that is refused: 11 % in the last tenth of 50 000 rows."""
    seen = turned(50_000, "vector")
    factor = np.where(np.arange(50_000) < 44_500, 1.0, 1.12)
    with pytest.raises(InputError, match="in one field"):
        require_one_field(factor, [], np.arange(50_000))
    columns = {f"{a}_lsb": v for a, v in zip("xyz", factor * 10.0 * seen.b_ut, strict=True)}
    columns |= {f"b{a}_ut": v for a, v in zip("xyz", seen.b_ut, strict=True)}
    with pytest.raises(InputError, match="from row 4450"):
        fit_log(log_of(columns), model_of(BASE))


def test_an_axis_without_noise_leaves_the_others_their_colour():
    """A simulated axis is exact to rounding; the standard errors of the others still grow in 1/f noise."""
    columns = record(Recipe({}, 4000, form="demodulated", corner=0.02, seed=3))
    fit = fit_log(log_of(columns | {"z_lsb": 10.0 * columns["bz_ut"]}), model_of(BASE))
    wider = dict(zip(fit.model.names, factors(fit), strict=True))
    assert wider["bias.x"] > 1.5
    assert wider["bias.y"] > 1.5
    assert np.all(np.isfinite(fit.stderr))


def test_normal_equations_that_say_nothing_are_refused():
    with pytest.raises(np.linalg.LinAlgError):
        solve_scaled(np.array([[1.0, 1.0], [1.0, 1.0 - 1e-12]]), np.ones(2))
    assert solve_scaled(np.diag([1e8, 1e-8]), np.array([2e8, 3e-8])) == pytest.approx([2.0, 3.0])
