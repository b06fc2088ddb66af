"""The noise of a fit: its law from a periodogram, seen while the sensor turns, and what it does to a magnitude."""

import numpy as np
import pytest
from barberpole.effects import Conditions, Setup
from barberpole.fit.gram import BLOCKS, add_samples, block_edges, empty
from barberpole.fit.noise import Noise, _seen_turning, _turning, estimate, expected, frequencies, power_law
from barberpole.fit.residual import Problem, cofactors
from barberpole.fit.solve import minimise
from barberpole.model import compose
from barberpole.observations import Observations
from scipy.optimize import least_squares


def coloured(rng, channels, n, corner, exponent, white):
    """(channels, n) of noise with S = white (1 + (corner / f)^exponent), cut out of a record ten times as long."""
    long = 10 * n
    f = np.fft.rfftfreq(long)
    f[0] = f[1]
    level = np.sqrt(white * (1.0 + (corner / f) ** exponent))
    made = np.fft.irfft(np.fft.rfft(rng.normal(size=(channels, long)), axis=1) * level, long, axis=1)
    return made[:, 4 * n : 5 * n]


@pytest.mark.parametrize(("corner", "exponent"), [(0.05, 1.0), (0.01, 1.6), (0.3, 0.8)])
def test_a_law_comes_back_from_its_noise(corner, exponent):
    white = np.array([4.0, 1.0, 9.0])
    channels = coloured(np.random.default_rng(3), 3, 20_000, corner, exponent, white[:, None])
    found = estimate(channels, "made")
    f = np.geomspace(1e-3, 0.4, 30)
    assert found.coloured
    ratio = found.white[:, None] * found.shape(f) / (white[:, None] * (1.0 + (corner / f) ** exponent))
    assert np.all(np.abs(ratio - 1.0) < 0.2)
    spectrum = expected(channels, f)
    assert np.all(np.abs(spectrum / (white[:, None] * power_law(f, corner, exponent)) - 1.0) < 0.2)
    assert found.rms(20_000) == pytest.approx(np.sqrt(np.mean(channels.var(axis=1))), rel=0.1)


def test_white_noise_is_said_to_be_white():
    rng, wrong = np.random.default_rng(8), 0
    for n in (300, 1000, 4001):
        for _ in range(10):
            channels = rng.normal(size=(3, n)) * np.array([[1.0], [2.0], [3.0]])
            found = estimate(channels, "made")
            wrong += found.coloured + (expected(channels, frequencies(n)) is not None)
            assert found.white == pytest.approx([1.0, 4.0, 9.0], rel=6.0 * np.sqrt(2.0 / n))
    assert wrong == 0
    flat = Noise(np.array([4.0, 12.0]))
    assert (flat.coloured, flat.rms(100)) == (False, pytest.approx(np.sqrt(8.0)))
    assert flat.common().white.tolist() == [8.0]


def test_power_that_a_fit_has_taken_is_not_missed():
    rng, n = np.random.default_rng(5), 4000
    kept = np.ones((1, n // 2 + 1))
    kept[:, 1:30] = 0.25
    seen = np.fft.rfft(rng.normal(size=(40, n)), axis=1)
    seen[:, 1:30] *= 0.5
    channels = np.fft.irfft(seen, n, axis=1)
    laws = [estimate(row[None], "made", kept) for row in channels]
    assert not any(law.coloured for law in laws)
    assert np.mean([law.white[0] for law in laws]) == pytest.approx(1.0, abs=0.015)


def test_a_sensor_sampled_faster_keeps_its_density():
    slow, ratio, level = Noise(np.array([3.0]), 0.02, 1.4), 4.0, 2.5
    fast = slow.at_rate(ratio, level)
    assert fast.white[0] == 3.0 * level

    def law(noise, f, interval):  # LSB^2/Hz of the power law alone
        return noise.white[0] * (noise.shape(f * interval) - 1.0) * interval

    for f_hz in (0.01, 0.3):
        assert law(fast, f_hz, 1.0 / ratio) == pytest.approx(law(slow, f_hz, 1.0), rel=1e-12)
    assert slow.at_rate(1.0).corner == pytest.approx(0.02)


def turned(n, seed):
    normal = np.random.default_rng(seed).normal(size=(3, n)).cumsum(axis=1)
    normal -= np.linspace(0, 1, n) * (normal[:, -1:] - normal[:, :1])
    return normal / np.linalg.norm(normal, axis=0)


def test_turning_leaves_white_noise_white():
    n = 512
    turning = _turning(turned(n, 1))
    assert turning[0] == pytest.approx(1.0)
    assert _seen_turning(np.ones(n // 2 + 1), turning, n) == pytest.approx(np.ones(n // 2 + 1))
    assert _seen_turning(np.full(n // 2 + 1, 3.0), None, n).tolist() == [3.0] * (n // 2 + 1)


def test_a_periodogram_seen_while_turning_is_what_noise_makes_it():
    """Mean periodogram of 2000 records of three coloured axes, projected on a normal that turns three times."""
    n, rng = 256, np.random.default_rng(2)
    phase = 2 * np.pi * 3.3 * np.arange(n) / n
    normal = np.array([np.cos(phase), np.sin(phase), 0 * phase])
    law = power_law(frequencies(n), 0.1, 1.0)
    axes = np.fft.irfft(np.fft.rfft(rng.normal(size=(2000, 3, n)), axis=2) * np.sqrt(law), n, axis=2)
    power = np.mean(np.abs(np.fft.rfft(np.sum(normal * axes, axis=1), axis=1)) ** 2, axis=0) / n
    shape = _seen_turning(law, _turning(normal), n)
    bins = [slice(1, 3), slice(3, 6), slice(6, 12), slice(12, 40), slice(40, 128)]
    ratios = [np.mean(power[b]) / np.mean(shape[b]) for b in bins]
    assert ratios == pytest.approx([1.0] * len(bins), abs=0.1)  # lags of more than half a record are left out
    assert np.mean(shape[1:3]) < 0.7 * np.mean(law[1:3])  # turning takes the slow part to the rate of turning


MATRIX = np.array([[3.0, 0.1, -0.2], [0.0, 3.4, 0.1], [0.3, 0.0, 2.6]])
K_UT, SIGMA_LSB = 50.0, 3.0


def scalar_problem(n, seed=1):
    rng = np.random.default_rng(seed)
    b = rng.normal(size=(3, n))
    b *= K_UT / np.linalg.norm(b, axis=0)
    y = MATRIX @ b + SIGMA_LSB * rng.normal(size=b.shape)
    seen = Observations(y, Conditions(state=np.zeros(n)), None, None, np.arange(n), "constant", False)
    model = compose(("bias", "scale", "soft_iron"), Setup(reference="constant", lsb_per_ut=3.0))
    return Problem(model, seen, K_UT)


def test_noise_lengthens_a_magnitude_by_what_the_fit_takes_off():
    n = 300_000
    problem = scalar_problem(n)
    p = truth_of(problem)
    residual, _, longer = (np.concatenate(part, axis=-1) for part in zip(*_pieces(problem, p), strict=True))
    spread = SIGMA_LSB / np.sqrt(n)
    assert np.mean(residual) > 8.0 * spread
    assert np.mean(residual[0] - SIGMA_LSB**2 * longer) == pytest.approx(0.0, abs=4.0 * spread)
    assert np.std(residual) == pytest.approx(SIGMA_LSB, rel=0.01)  # as that of one reading


def truth_of(problem):
    """Parameters whose matrix is MATRIX but for a rotation of the field, which a magnitude does not see."""
    axes, model = np.hstack([np.zeros((3, 1)), np.eye(3)]), problem.model

    def miss(p):
        made = model.predict(axes, p, Conditions())
        matrix = made[:, 1:] - made[:, :1]
        return np.append(matrix @ matrix.T - MATRIX @ MATRIX.T, made[:, 0])

    return least_squares(miss, model.first, x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15).x


def _pieces(problem, p):
    linearise = problem.linearisation(p)
    return [linearise(rows) for rows in problem.chunks()]


def test_a_fit_of_magnitudes_takes_off_the_noise_that_it_finds():
    """Its own noise, to a hundredth; without that the gains would be too small by twelve standard errors."""
    n = 300_000
    problem = scalar_problem(n)
    truth = truth_of(problem)
    found = minimise(problem, truth * 1.02 + 0.1, np.ones(truth.size, bool))
    assert found.converged
    assert found.gram.sigma == pytest.approx(found.gram.rms(), rel=0.011)
    assert found.gram.rms() == pytest.approx(SIGMA_LSB, rel=0.01)
    apart = (found.p - truth) / np.sqrt(np.diag(found.covariance))
    assert np.mean(apart**2) < 1.0 + 4.0 * np.sqrt(2.0 / truth.size)


def test_sums_know_what_any_noise_does_to_them():
    problem = scalar_problem(3000)
    p = problem.model.first + 0.01
    gram = empty(len(p), True)
    add_samples(gram, problem, p, block_edges(problem.n), 0)
    r, j, c = (np.concatenate(part, axis=-1) for part in zip(*_pieces(problem, p), strict=True))
    block = np.repeat(np.arange(BLOCKS), np.diff(block_edges(problem.n)))
    for sigma in (0.0, 1.5, 4.0):
        shorter, noisy = r[0] - sigma**2 * c, gram.at_noise(1.0).at_noise(sigma)
        for b in range(BLOCKS):
            own = block == b
            assert noisy.rr[b] == pytest.approx(np.sum(shorter[own] ** 2), rel=1e-9)
            assert noisy.jr[b] == pytest.approx(j[0][:, own] @ shorter[own], rel=1e-7, abs=1e-7 * abs(gram.jr).max())
            assert noisy.jj[b] == pytest.approx(j[0][:, own] @ j[0][:, own].T, rel=1e-9)
        assert (noisy.sigma, noisy.count) == (sigma, problem.n)
    assert empty(3, False).longer is None


def test_cofactors_are_the_inverse_transposed():
    m = np.random.default_rng(9).normal(size=(3, 3, 50))
    cofactor, det = cofactors(m)
    assert det == pytest.approx(np.linalg.det(m.transpose(2, 0, 1)))
    assert (cofactor / det).transpose(2, 1, 0) == pytest.approx(np.linalg.inv(m.transpose(2, 0, 1)))
