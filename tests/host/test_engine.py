"""The engine of the fit: shortcuts say what the long way says, and the answer is as sharp as the data allow."""

import numpy as np
import pytest
from barberpole.effects import Conditions, Setup
from barberpole.errors import InputError
from barberpole.fit.affine import moments
from barberpole.fit.fit import fit_observations
from barberpole.fit.gram import Gram, add_samples, block_edges, empty
from barberpole.fit.residual import Problem
from barberpole.methods.ellipsoid import Ellipsoid, cramer_rao
from barberpole.model import compose
from barberpole.modelfile import ModelFile
from barberpole.observations import Observations

LINEAR = ("bias", "scale", "misalignment")
NOISE_LSB = 0.3


def turned(n: int, reference: str, seed: int = 1, planar: bool = False) -> Observations:
    """n readings of a sensor with three gains, crooked axes and a bias, in 50 µT."""
    rng = np.random.default_rng(seed)
    b = rng.normal(size=(3, n)) * np.array([1.0, 1.0, 0.0 if planar else 1.0])[:, None]
    b *= 50.0 / np.linalg.norm(b, axis=0)
    y = MATRIX @ b + OFFSET[:, None] + NOISE_LSB * rng.normal(size=b.shape)
    at = Conditions(state=np.zeros(n), t_s=np.arange(n) / 100.0, temp_c=np.full(n, 25.0))
    return Observations(y, at, b if reference == "vector" else None, None, np.arange(n), reference, False)


MATRIX = np.array([[3.0, 0.03, -0.03], [0.0, 3.3, 0.03], [0.0, 0.0, 2.7]])
OFFSET = np.array([30.0, -20.0, 10.0])


def the_long_way(problem: Problem, p: np.ndarray) -> Gram:
    """Sample by sample, through the model's own derivatives."""
    gram = empty(len(p), not problem.vector)
    add_samples(gram, problem, p, block_edges(problem.n), 0)
    return gram


@pytest.mark.parametrize("reference", ["vector", "constant"])
def test_moments_say_what_the_samples_say(reference):
    seen = turned(5003, reference)
    model = compose(LINEAR, Setup(reference=reference, lsb_per_ut=3.0))
    p = model.first + 1e-3 * np.arange(len(model.names))
    taken = None if seen.b_ut is None else moments(seen.y, seen.b_ut)
    problem = Problem(model, seen, moments=taken)
    short, long = problem.gram(p), the_long_way(problem, p)
    for name in ("jj", "jr", "rr", "m"):
        one, other = getattr(short, name), getattr(long, name)
        assert one == pytest.approx(other, rel=1e-9, abs=1e-9 * np.max(np.abs(other)))


def test_moments_of_other_readings_are_not_used():
    seen, other = turned(600, "vector"), turned(600, "vector", seed=2)
    model = compose(LINEAR, Setup(lsb_per_ut=3.0))
    problem = Problem(model, seen, moments=moments(other.y, np.asarray(other.b_ut)))
    assert problem.gram(model.first).cost == pytest.approx(the_long_way(problem, model.first).cost, rel=1e-12)


def test_normal_equations_follow_noise_and_small_steps():
    problem = Problem(compose(LINEAR, Setup(reference="constant", lsb_per_ut=3.0)), turned(2000, "constant"))
    p = fit_observations(problem.seen, ModelFile(LINEAR)).p
    step = 1e-4 * np.abs(p)
    at_noise, again = problem.gram(p).at_noise(0.4), problem.gram(p, 0.4)
    assert at_noise.rr == pytest.approx(again.rr, rel=1e-12)
    moved, there = again.moved(step), problem.gram(p + step, 0.4)
    assert moved.cost == pytest.approx(there.cost, rel=1e-4)
    assert moved.at_noise(0.0).cost == pytest.approx(problem.gram(p + step).cost, rel=1e-4)


def test_a_scalar_fit_reaches_the_cramer_rao_bound():
    """Squared error in units of the bound over 12 logs of nine parameters: 1 +- 0.14, where more data show a bias."""
    upper = np.linalg.cholesky(np.linalg.inv(MATRIX @ MATRIX.T)).T
    corner, square = np.triu_indices(3), []
    for seed in range(12):
        fit = fit_observations(turned(100_000, "constant", seed), ModelFile(LINEAR))
        y = fit.model.predict(np.hstack([np.zeros((3, 1)), np.eye(3)]), fit.p, Conditions())
        inverse = np.linalg.inv(y[:, 1:] - y[:, :1])
        found = np.linalg.cholesky(inverse.T @ inverse).T
        apart = np.append(found[corner] - upper[corner], y[:, 0] - OFFSET)
        bound = cramer_rao(turned(100_000, "constant", seed).y, Ellipsoid(upper, OFFSET), 50.0, NOISE_LSB)
        square.append(apart @ np.linalg.solve(bound, apart) / 9)
    assert np.mean(square) < 1.0 + 3 * 0.14


def test_a_planar_turn_is_refused_where_only_the_magnitude_is_known():
    with pytest.raises(InputError, match="surround the sensor"):
        fit_observations(turned(2000, "constant", planar=True), ModelFile(LINEAR))
