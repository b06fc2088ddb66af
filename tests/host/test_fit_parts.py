"""Parts of a fit against what they stand for: samples for all, what a fit leaves of noise, a free residual's spread."""

from types import SimpleNamespace

import numpy as np
import pytest
from barberpole.challenge.record import Recipe, record
from barberpole.effects import Conditions, Setup
from barberpole.fit.affine import moments
from barberpole.fit.easy_axes import _errors_of
from barberpole.fit.few import ENOUGH, few
from barberpole.fit.fit import fit_observations, setup_of
from barberpole.fit.gram import accumulate
from barberpole.fit.honest import _by_stretches, _kept, _left_open, _reddened
from barberpole.fit.residual import CHUNK, Problem
from barberpole.fit.solve import _held_by_bound
from barberpole.model import compose
from barberpole.modelfile import ModelFile
from barberpole.observations import Observations, observations
from scipy.stats import chi2, t
from truth.trials import log_of


@pytest.mark.parametrize("n", [1, ENOUGH, ENOUGH + 1, 3 * ENOUGH - 7, 100_000])
def test_some_samples_are_one_of_each_stretch(n):
    taken = np.arange(n)[few(n)]
    assert len(taken) == min(n, ENOUGH)
    assert np.all(np.diff(taken) >= 0)
    begin = np.arange(len(taken)) * n / len(taken)
    assert np.all((taken > begin - 1) & (taken < begin + n / len(taken)))
    if n >= 3 * ENOUGH - 7:
        for period in (2, 3, 10, 16):  # of whatever takes turns in the log
            seen = np.bincount(taken % period, minlength=period) / len(taken)
            assert seen == pytest.approx(np.full(period, 1.0 / period), abs=0.05)


def test_what_a_fit_leaves_of_white_noise_is_that_of_its_residual_maker():
    n, rng = 96, np.random.default_rng(1)
    columns = rng.normal(size=(2, 4, n)) + np.cos(2 * np.pi * 3 * np.arange(n) / n)
    flat = columns.transpose(0, 2, 1).reshape(2 * n, 4)
    inverse = np.linalg.inv(flat.T @ flat)
    maker = np.eye(2 * n) - flat @ inverse @ flat.T
    waves = np.exp(-2j * np.pi * np.outer(np.arange(n // 2 + 1), np.arange(n)) / n)
    for channel, kept in enumerate(_kept(columns, inverse)):
        own = slice(channel * n, (channel + 1) * n)
        power = np.real(np.einsum("ft,ts,fs->f", waves, maker[own, own], waves.conj())) / n
        assert kept == pytest.approx(power, abs=1e-12)
    assert _kept(columns, inverse)[:, 3].max() < 0.9  # where the columns are, something is taken


def test_red_residuals_are_told_from_white_ones():
    rng, n = np.random.default_rng(4), 8000
    neighbours = lambda r: r.reshape(2, -1, 8).sum(axis=2)  # noqa: E731
    white = [rng.normal(size=(2, n)) * [[1.0], [7.0]] for _ in range(200)]
    assert sum(_reddened(neighbours(r), np.mean(r**2, axis=1)) for r in white) <= 1  # four standard deviations
    slow = white[0] + 0.35 * np.sqrt(2) * np.sin(2 * np.pi * 20 * np.arange(n) / n) * [[1.0], [7.0]]
    assert _reddened(neighbours(slow), np.mean(slow**2, axis=1))
    quick = white[0] + 2.0 * np.sin(2 * np.pi * 1900 * np.arange(n) / n) * [[1.0], [7.0]]
    assert not _reddened(neighbours(quick), np.mean(quick**2, axis=1))


def stretched(pull):
    """A fit of two columns over ten stretches of 100 unit residuals, whose pulls J^T r are given."""
    gram = SimpleNamespace(jr=np.array(pull), count=1000, jj=np.repeat([np.diag([10.0, 40.0])], 10, axis=0), cost=998.0)
    return SimpleNamespace(gram=gram)


def test_stretches_that_disagree_widen_as_the_sandwich_says():
    inverse, free = np.diag([1 / 100.0, 1 / 400.0]), np.array([0, 1])
    white = np.diag(inverse)
    rng = np.random.default_rng(3)
    quiet = rng.normal(size=(10, 2)) * np.sqrt([10.0, 40.0])
    assert _by_stretches(stretched(quiet), free, inverse, white).tolist() == [1.0, 1.0]
    pulled = quiet.copy()
    pulled[4, 0] += 60.0
    apart = pulled - pulled.mean(axis=0)
    between = 10 / 9 * np.sum(apart[:, 0] ** 2) * inverse[0, 0] ** 2 / white[0]
    assert between > chi2.isf(1e-4, 9) / 9
    widened = _by_stretches(stretched(pulled), free, inverse, white)
    assert widened == pytest.approx([between * (t.ppf(0.975, 9) / 1.96) ** 2, 1.0], rel=1e-9)
    short = stretched(pulled)
    short.gram.count = 10 * (2 + 10) - 1
    assert _by_stretches(short, free, inverse, white).tolist() == [1.0, 1.0]


def test_a_parameter_left_open_widens_what_shares_its_column():
    h = np.array([[100.0, 0.0, 30.0], [0.0, 400.0, 0.0], [30.0, 0.0, 9.0]])
    inverse, free = np.diag([1 / 100.0, 1 / 400.0]), np.array([0, 1])
    names, params = ("cubic.x", "cubic.y", "late.z"), [SimpleNamespace(typical=s, inner=False) for s in (1.0, 1.0, 0.5)]
    fit = SimpleNamespace(
        gram=SimpleNamespace(jj=h[None]),
        model=SimpleNamespace(names=names, params=params),
        free=np.array([True, True, False]),
        held=frozenset(),
    )
    more = _left_open(fit, free, inverse, np.diag(inverse))
    assert more == pytest.approx([(30.0 / 100.0 * 0.5) ** 2 / 0.01, 0.0])
    fit.model.names = ("cubic.x", "cubic.y", "bias.z")  # of the basic ones ten times the typical size
    assert _left_open(fit, free, inverse, np.diag(inverse))[0] == pytest.approx(100.0 * more[0])
    fit.held = frozenset({"bias.z"})  # known from elsewhere
    assert not _left_open(fit, free, inverse, np.diag(inverse)).any()


def test_only_what_pushes_against_its_bound_is_held_there():
    lower, upper = np.zeros(5), np.ones(5)
    gram = SimpleNamespace(jr=np.array([[-2.0, 2.0, 3.0, -3.0, 5.0], [0.0, 0.0, 0.0, 0.0, 0.0]]))
    held = _held_by_bound(np.array([0.0, 0.0, 1.0, 1.0, 0.5]), gram, lower, upper)
    assert held.tolist() == [True, False, True, False, False]


def test_every_sample_is_told_once_a_pass():
    log = log_of(record(Recipe({}, rows=CHUNK + 500)))
    fit = fit_observations(observations(log), ModelFile(("bias", "scale")))
    told = []
    problem = Problem(fit.model, fit.problem.seen)
    accumulate(problem, fit.p, tick=told.append)
    assert told == [CHUNK, problem.n - CHUNK]


@pytest.mark.parametrize("chunk", [700, 3000])
def test_derivatives_of_a_distance_are_those_of_the_readings(chunk, monkeypatch):
    """Of a sensor with memory too, whose fitted field hangs on earlier readings."""
    monkeypatch.setattr("barberpole.fit.residual.CHUNK", chunk)
    rng, n = np.random.default_rng(3), 900
    turn = np.cumsum(rng.normal(size=(3, n)), axis=1)
    turn *= 50.0 / np.linalg.norm(turn, axis=0)
    at = Conditions(state=np.zeros(n), t_s=np.arange(n) / 100.0)
    for effects in (("bias", "scale", "misalignment"), ("bias", "scale", "misalignment", "lag")):
        setup = Setup(reference="constant", lsb_per_ut=3.0, duration_s=9.0, interval_s=0.01)
        model = compose(effects, setup)
        p = model.first + 0.01 * np.array([q.typical for q in model.params])
        y = model.predict(turn, p, at)
        problem = Problem(model, Observations(y, at, None, None, np.arange(n), "constant", False), 50.0)
        assert np.max(np.abs(problem.residual(p))) < 1e-9
        found = np.concatenate([problem.linearisation(p)(rows)[1] for rows in problem.chunks()], axis=2)[0]
        for j, param in enumerate(model.params):
            step = np.zeros(len(p))
            step[j] = 1e-5 * param.typical
            slope = (problem.residual(p + step) - problem.residual(p - step))[0] / (2 * step[j])
            settled = slice(5, None)
            assert found[j][settled] == pytest.approx(-slope[settled], rel=0.02, abs=0.02 * np.abs(slope).max()), param


def test_moments_of_all_readings_are_not_used_where_some_are_not_believed():
    log = log_of(record(Recipe({}, rows=800)))
    seen = observations(log)
    fit = fit_observations(seen, ModelFile(("bias", "scale")))
    believed = np.random.default_rng(2).random(seen.y.shape) > 0.1
    some = Problem(fit.model, seen, believed=believed, moments=moments(seen.y, np.asarray(seen.b_ut)))
    gram = some.gram(fit.p)
    assert gram.count == np.count_nonzero(believed)
    assert gram.cost == pytest.approx(np.sum((some.residual(fit.p) * believed) ** 2), rel=1e-9)
    assert Problem(fit.model, seen, moments=some.moments)._known is some.moments
    assert some._known is None
    assert some.largest == np.max(np.abs(seen.y))


def test_coefficients_over_standard_errors_are_those_of_a_regression():
    rng = np.random.default_rng(7)
    columns, n = rng.normal(size=(60, 4)) * [1.0, 10.0, 0.1, 3.0], 60
    values = columns @ [0.3, -0.01, 4.0, 0.05] + 0.5 * rng.normal(size=n)
    answer, left = np.linalg.lstsq(columns, values, rcond=None)[:2]
    spread = np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)) * left[0] / (n - 4))
    assert _errors_of(columns, values, 3) == pytest.approx(np.abs(answer / spread)[-3:], rel=1e-9)


def test_an_effect_is_told_the_size_of_the_log():
    log = log_of(record(Recipe({}, rows=400)))
    seen = observations(log)
    fit = fit_observations(seen, ModelFile(("bias", "scale")))
    setup = setup_of(seen, fit.linear)
    t_s = seen.at.t_s
    assert setup.duration_s == pytest.approx(t_s[-1] - t_s[0])
    assert setup.interval_s == pytest.approx((t_s[-1] - t_s[0]) / (len(t_s) - 1))
    assert setup.lsb_per_ut == pytest.approx(10.0, rel=0.2)
    assert setup.span_ut == pytest.approx(1.5 * fit.linear.span_ut)
    timeless = setup_of(SimpleNamespace(at=Conditions(state=0.0), y=np.zeros((3, 7)), reference="vector"), fit.linear)
    assert (timeless.duration_s, timeless.interval_s) == (7.0, 7.0 / 6.0)
    assert (timeless.load_a, timeless.current_ma) == (1.0, 1.0)


def test_a_field_spans_where_it_leaves_no_plane():
    corners = np.array([[1.0, -1.0, -1.0, 1.0], [1.0, -1.0, 1.0, -1.0], [1.0, 1.0, -1.0, -1.0]]) * 30.0
    assert moments(2.0 * corners, corners).spans(0.5)
    assert not moments(2.0 * corners[:, :3], corners[:, :3]).spans(1e-3)  # three readings lie in a plane
    thin = corners * [[1.0], [1.0], [1e-2]]
    assert moments(thin, thin).spans(0.9e-2)
    assert not moments(thin, thin).spans(1.1e-2)
