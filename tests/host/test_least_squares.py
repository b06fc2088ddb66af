"""The solver and what is read off its normal equations, against scipy and against the long way."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from barberpole.errors import InputError
from barberpole.fit import observability
from barberpole.fit.gram import BLOCKS, FOLDS, Gram, block_edges, heldout_rms, pieces, solve_scaled
from barberpole.fit.solve import descend, minimise
from scipy.optimize import least_squares, lsq_linear

N, WIDE = 240, np.full(5, np.inf)


class Curve:
    """Residuals data - f(p) as a problem of the solver; counts its passes."""

    vector = True

    def __init__(self, function, slope, data, lower, upper, straight=0.0):
        self._function, self._slope, self._data, self._straight = function, slope, data, straight
        self.model = SimpleNamespace(bounds=lambda: (lower, upper))
        self.n, self.largest, self.passes = len(data), float(np.max(np.abs(data))), 0

    def straight(self, rms):
        return self._straight

    def residual(self, p):
        return self._data - self._function(p)

    def gram(self, p, sigma=0.0, tick=None):
        self.passes += 1
        r, j, edges = self.residual(p), self._slope(p), block_edges(self.n)
        parts = [(r[a:b], j[a:b]) for a, b in pairwise(edges)]
        jj, jr, rr = (np.array(rows) for rows in zip(*((c.T @ c, c.T @ s, s @ s) for s, c in parts), strict=True))
        return Gram(jj, jr, rr, np.diff(edges).astype(float))


def line(seed, lower=-WIDE, upper=WIDE):
    """(matrix, data, problem): five columns that are alike, of very different sizes."""
    rng = np.random.default_rng(seed)
    matrix = (rng.normal(size=(N, 5)) + rng.normal(size=(N, 1))) * np.array([1.0, 30.0, 0.01, 5.0, 200.0])
    data = matrix @ (rng.normal(size=5) / np.abs(matrix).max(axis=0)) + 0.1 * rng.normal(size=N)
    return matrix, data, Curve(lambda p: matrix @ p, lambda p: matrix, data, lower, upper, 1e-4)


ALL = np.ones(5, bool)


@pytest.mark.parametrize("seed", range(8))
def test_a_line_within_bounds_is_scipys_answer(seed):
    matrix, data, _ = line(seed)
    best = np.linalg.lstsq(matrix, data, rcond=None)[0]
    size = np.abs(best)
    lower, upper = best - size * [0.2, 3.0, 3.0, 3.0, -0.1], best + size * [3.0, 3.0, -0.2, 3.0, 3.0]
    problem = line(seed, lower, upper)[2]
    found = minimise(problem, 0.5 * (lower + upper), ALL)
    truth = lsq_linear(matrix, data, (lower, upper), method="bvls", tol=1e-14)
    assert truth.active_mask.any()
    assert found.converged
    assert np.all((found.p >= lower) & (found.p <= upper))
    assert np.sum(problem.residual(found.p) ** 2) == pytest.approx(2 * truth.cost, rel=1e-8)
    assert found.p == pytest.approx(truth.x, rel=1e-4, abs=1e-4 * size.min())
    assert found.gram.cost == pytest.approx(2 * truth.cost, rel=1e-8)


def test_without_bounds_it_takes_one_pass_and_holds_what_is_not_free():
    matrix, data, problem = line(1)
    start = np.array([0.3, 0.0, 0.0, 0.2, 0.0])
    free = np.array([False, True, True, False, True])
    found = minimise(problem, start, free)
    rest = np.linalg.lstsq(matrix[:, free], data - matrix @ np.where(free, 0.0, start), rcond=None)[0]
    assert found.p[free] == pytest.approx(rest, rel=1e-6)
    assert np.array_equal(found.p[~free], start[~free])
    assert problem.passes <= 3  # at the start, after the first step, and once more while that was damped


def test_a_curve_is_scipys_answer():
    t = np.linspace(0.0, 4.0, N)
    data = 3.0 * np.exp(-0.7 * t) + 0.5 + 0.01 * np.random.default_rng(2).normal(size=N)

    def value(p):
        return p[0] * np.exp(-p[1] * t) + p[2]

    def slope(p):
        fall = np.exp(-p[1] * t)
        return np.array([fall, -p[0] * t * fall, np.ones(N)]).T

    wide = np.full(3, np.inf)
    problem = Curve(value, slope, data, -wide, wide)
    found = minimise(problem, np.array([0.5, 3.0, 2.0]), np.ones(3, bool))
    truth = least_squares(lambda p: data - value(p), [0.5, 3.0, 2.0], jac=lambda p: -slope(p), xtol=1e-15)
    assert found.converged
    assert found.p == pytest.approx(truth.x, rel=1e-6)
    assert found.covariance == pytest.approx(
        2 * truth.cost / (N - 3) * np.linalg.inv(truth.jac.T @ truth.jac), rel=1e-4
    )
    assert problem.passes < 20


def test_where_no_step_helps_it_stays_and_says_so():
    problem = line(3)[2]
    first = problem.gram(np.zeros(5))
    nothing = replace(first, rr=np.full(BLOCKS, np.nan))
    broken = SimpleNamespace(model=problem.model, vector=True, straight=lambda rms: 1e-4, n=N, largest=1.0, passes=0)

    def gram(p, sigma=0.0, tick=None):
        broken.passes += 1
        return nothing

    broken.gram = gram
    found = descend(broken, np.zeros(5), ALL, first, 1e-10, None)
    assert (found.converged, broken.passes <= 12) == (False, True)  # a factor of 30 each, from 1e-6 to 1e8
    assert np.array_equal(found.p, np.zeros(5))
    with pytest.raises(InputError, match="within what the model can invert"):
        descend(broken, np.zeros(5), ALL, nothing, 1e-10, None)


def test_held_out_error_is_that_of_refits():
    matrix, data, problem = line(4)
    found = minimise(problem, np.zeros(5), ALL)
    edges, left = block_edges(N), 0.0
    block = np.repeat(np.arange(BLOCKS), np.diff(edges))
    for fold in range(FOLDS):
        out = block % FOLDS == fold
        p = np.linalg.lstsq(matrix[~out], data[~out], rcond=None)[0]
        left += np.sum((data[out] - matrix[out] @ p) ** 2)
    assert heldout_rms(found.gram) == pytest.approx(np.sqrt(left / N), rel=1e-6)
    assert found.gram.rms() == pytest.approx(np.sqrt(np.mean(problem.residual(found.p) ** 2)), rel=1e-9)
    only = replace(found.gram, jj=found.gram.jj * (np.arange(BLOCKS) % FOLDS == 0)[:, None, None])
    assert heldout_rms(only) == float("inf")  # one fold holds all that is known


def test_sums_follow_a_step_exactly_where_nothing_bends():
    _, _, problem = line(5)
    p, step = np.full(5, 0.01), np.array([0.02, -0.001, 3.0, 0.01, -0.0005])
    moved, there = problem.gram(p).moved(step), problem.gram(p + step)
    for name in ("jj", "jr", "rr", "m"):
        assert getattr(moved, name) == pytest.approx(getattr(there, name), rel=1e-9)
    part = there.take(np.array([0, 3]))
    assert part.jj == pytest.approx(there.jj[:, [0, 3]][:, :, [0, 3]])
    assert part.jr == pytest.approx(there.jr[:, [0, 3]])


def test_scaled_equations_are_solved():
    matrix, data, _ = line(6)
    h, g = matrix.T @ matrix, matrix.T @ data
    assert solve_scaled(h, g) == pytest.approx(np.linalg.solve(h, g), rel=1e-9)
    assert solve_scaled(h, g, 0.3) == pytest.approx(np.linalg.solve(h + 0.3 * np.diag(np.diag(h)), g), rel=1e-9)
    with pytest.raises(np.linalg.LinAlgError):
        solve_scaled(np.ones((2, 2)) - np.eye(2), np.ones(2))


@pytest.mark.parametrize("n", [10, 999, 1000])
@pytest.mark.parametrize("size", [1, 7, 400])
def test_chunks_fall_into_blocks_without_gap_or_overlap(n, size):
    edges = block_edges(n)
    assert (edges[0], edges[-1], len(edges)) == (0, n, BLOCKS + 1)
    found = np.full(n, -1)
    for at in range(0, n, size):
        before = at // 2  # as if the log had come in two files
        for block, part in pieces(edges, before, slice(at - before, min(at + size, n) - before)):
            assert np.all(found[at + part.start : at + part.stop] == -1)
            found[at + part.start : at + part.stop] = block
    assert np.array_equal(found, np.repeat(np.arange(BLOCKS), np.diff(edges)))


def model_of(names, typical, null=0.0):
    params = [SimpleNamespace(typical=t) for t in typical]
    return SimpleNamespace(names=names, params=params, null=np.full(len(names), null))


NAMES = ("late.a", "bias.x", "scale.x", "early.b", "drift.c")


def test_columns_that_say_the_same_are_kept_once_and_the_basic_one_stays():
    matrix, data, _ = line(7)
    matrix[:, 0] = 2.0 * matrix[:, 1] - 0.1 * matrix[:, 2]  # late.a hides in bias and scale
    matrix[:, 4] = 0.0
    gram = Curve(lambda p: matrix @ p, lambda p: matrix, data, -WIDE, WIDE).gram(np.zeros(5))
    model = model_of(NAMES, (1.0,) * 5)
    assert observability.independent(model, gram, ALL).tolist() == [False, True, True, True, False]
    held = ALL & (np.arange(5) != 1)
    assert observability.independent(model, gram, held).tolist() == [True, False, True, True, False]
    assert observability.absent(gram).tolist() == [False, False, False, False, True]


def test_condition_and_covariance_are_those_of_the_columns():
    matrix, data, problem = line(8)
    gram = problem.gram(np.linalg.lstsq(matrix, data, rcond=None)[0])
    unit = matrix / np.linalg.norm(matrix, axis=0)
    assert observability.condition(gram, ALL) == pytest.approx(np.linalg.cond(unit), rel=1e-6)
    free = np.array([True, True, False, True, True])
    left = matrix[:, free]
    variance = gram.cost / (N - 4)
    found = observability.covariance(gram, free)
    assert found[np.ix_(free, free)] == pytest.approx(variance * np.linalg.inv(left.T @ left), rel=1e-9)
    assert not found[2].any()
    assert not found[:, 2].any()
    assert observability.condition(gram, free) == pytest.approx(np.linalg.cond(unit[:, free]), rel=1e-6)


def test_what_says_less_than_a_real_sensor_shows_is_undetermined():
    names, p = ("bias.x", "cubic.x", "cubic.y"), np.array([0.0, 0.0, 40.0])
    covariance = np.diag(np.array([2.9, 6.2, 7.0]) ** 2)
    model, free = model_of(names, (1.0, 2.0, 1.0)), np.ones(3, bool)
    assert observability.undetermined(model, covariance, free, p) == 1  # 3.1 times its size; the third shows at 5.7
    assert observability.undetermined(model, covariance, free, np.array([0.0, 0.0, 34.0])) == 2
    assert observability.undetermined(model, covariance, free & (np.arange(3) != 1), p) is None
    hidden = np.diag(np.array([3.1, 1.0, 1.0]) ** 2)
    assert observability.undetermined(model, hidden, free, np.array([400.0, 0.0, 0.0])) == 0  # a basic one never shows
