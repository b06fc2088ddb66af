"""Two-step scalar calibration (thesis 4.8-4.20), and the steps that make its answer as sharp as the data allow.

    h -> H = L (h - b),  |H| = K,  L upper triangular                                (4.18-4.20)

`algebraic` minimises 4.19 in closed form. Its regressors are squares of noisy readings, which leaves a bias of order
sigma²/K that more data do not lessen. `efficient` goes on from there with Gauss-Newton steps on the distance of each
reading h from the surface |H| = K, in the units of the reading:

    r = (|H| - K) / |g| - sigma² c,    g = L^T H / |H|,    c = (tr L^T L - g² ) / (2 K |g|)      (1)
    d r / d L_ij = n_i f_j / |g|,  d r / d b = -g / |g|,  f = h - b - g (|H| - K) / g²           (2)

n = H / |H|; f is the foot point on the surface, which the noise along the normal does not reach; c is what noise
across the field adds to its length on average. sigma is the rms of r. Shapes: readings (3, n), parameters (9,).
"""

from typing import NamedTuple

import numpy as np

from barberpole.fit.ellipsoid import Ellipsoid, algebraic, coverage_message

__all__ = ["Ellipsoid", "algebraic", "certainty", "coverage_message", "cramer_rao", "efficient"]

CHUNK = 4096  # readings at a time, so that the columns of (2) stay in the cache
MAX_STEPS = 8
SETTLED = 1e-4  # squared length of a step, in standard errors, that need not be followed by another
UPPER = np.triu_indices(3)


class _Normal(NamedTuple):
    """J^T J (9, 9), J^T r (9,), J^T c (9,), r^T r and the number of readings."""

    jj: np.ndarray
    jr: np.ndarray
    jc: np.ndarray
    rr: float
    n: int

    @property
    def variance(self) -> float:
        """sigma² of one reading."""
        return self.rr / max(self.n - 9, 1)

    def step(self) -> np.ndarray:
        """Gauss-Newton step (9,) of (1)."""
        return -np.linalg.solve(self.jj, self.jr - self.variance * self.jc)


def efficient(reading: np.ndarray, magnitude: float = 1.0) -> Ellipsoid:
    """Ellipsoid through readings (3, n) in LSB with |H| = magnitude, at the Cramér-Rao bound for small white noise.

    Raises InputError as `algebraic` does; where no step lowers the residual, its answer is returned.
    """
    shape = algebraic(reading, magnitude)
    best = _normal(reading, shape, magnitude)
    for _ in range(MAX_STEPS):
        try:
            step = best.step()
        except np.linalg.LinAlgError:
            return shape
        trial = _moved(shape, step)
        if not np.all(np.diag(trial.upper) > 0):
            return shape
        if step @ best.jj @ step <= SETTLED * best.variance:
            return trial
        found = _normal(reading, trial, magnitude)
        if not found.rr <= best.rr * (1.0 + 1e-3):
            return shape
        shape, best = trial, found
    return shape


def cramer_rao(reading: np.ndarray, shape: Ellipsoid, magnitude: float, sigma_lsb: float) -> np.ndarray:
    """Smallest covariance (9, 9) of L11 L12 L13 L22 L23 L33 b1 b2 b3 that noise sigma_lsb on these readings allows."""
    return sigma_lsb**2 * np.linalg.inv(_normal(reading, shape, magnitude).jj)


def certainty(reading: np.ndarray, shape: Ellipsoid, magnitude: float) -> tuple[float, np.ndarray]:
    """Noise of a reading in LSB, nine of them taken up by the fit, and the covariance (9, 9) that it implies.

    Raises numpy's LinAlgError where a direction is not seen at all.
    """
    normal = _normal(reading, shape, magnitude)
    return float(np.sqrt(normal.variance)), normal.variance * np.linalg.inv(normal.jj)


def _moved(shape: Ellipsoid, step: np.ndarray) -> Ellipsoid:
    upper = shape.upper.copy()
    upper[UPPER] += step[:6]
    return Ellipsoid(upper, shape.centre + step[6:])


def _normal(reading: np.ndarray, shape: Ellipsoid, magnitude: float) -> _Normal:
    """The normal equations of (1)-(2), summed over chunks."""
    jj, jr, jc, rr = np.zeros((9, 9)), np.zeros(9), np.zeros(9), 0.0
    n = reading.shape[1]
    columns = np.empty((9, min(n, CHUNK)))
    for at in range(0, n, CHUNK):
        part = reading[:, at : at + CHUNK]
        j = columns[:, : part.shape[1]]
        r, c = _distance(part, shape, magnitude, j)
        jj += j @ j.T
        jr += j @ r
        jc += j @ c
        rr += float(r @ r)
    return _Normal(jj, jr, jc, rr, n)


def _distance(part: np.ndarray, shape: Ellipsoid, magnitude: float, j: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """r without its noise term and c of (1), each (k,); the columns (2) are written to j (9, k)."""
    u = part - shape.centre[:, None]
    field = shape.upper @ u
    size = np.sqrt(np.einsum("ik,ik->k", field, field))
    g = shape.upper.T @ (field / size)
    steep2 = np.einsum("ik,ik->k", g, g)
    per_steep = 1.0 / np.sqrt(steep2)
    r = (size - magnitude) * per_steep
    foot = u - g * (r * per_steep)
    unit = field * (per_steep / size)
    np.multiply(unit[0], foot, out=j[:3])
    np.multiply(unit[1], foot[1:], out=j[3:5])
    np.multiply(unit[2], foot[2], out=j[5])
    np.multiply(g, -per_steep, out=j[6:])
    return r, (np.sum(shape.upper**2) - steep2) * (per_steep / (2.0 * magnitude))
