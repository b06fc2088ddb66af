"""Two-step scalar calibration: an ellipsoid through the readings, split by Cholesky (thesis 4.8-4.20).

While only the magnitude of the field is known, the readings h of a linear sensor lie on an ellipsoid
    (h - b)^T D (h - b) = K^2,   D = L^T L,   H = L (h - b)                          (4.14, 4.17, 4.20)
with L upper triangular, the choice that leaves out any rotation (4.18).
"""

from dataclasses import dataclass

import numpy as np

from barberpole.errors import CoverageError

CHUNK = 4096  # samples at a time
MIN_SAMPLES = 12  # nine unknowns, and something left to judge them by


@dataclass(frozen=True)
class Ellipsoid:
    """H = L (h - b): L (3, 3) upper triangular in (unit of K)/LSB, b (3,) in LSB."""

    upper: np.ndarray
    centre: np.ndarray

    def field(self, reading: np.ndarray) -> np.ndarray:
        """Calibrated vector (3, n) from readings (3, n), eq. 4.20."""
        return self.upper @ (reading - self.centre[:, None])


def algebraic(reading: np.ndarray, magnitude: float = 1.0) -> Ellipsoid:
    """Least-squares ellipsoid through readings (3, n) in LSB, scaled so that |H| = magnitude (4.19).

    Raises CoverageError when the readings do not determine an ellipsoid, saying what is missing.
    """
    n = reading.shape[1]
    if n < MIN_SAMPLES:
        raise CoverageError(f"an ellipsoid fit must have at least {MIN_SAMPLES} samples; got {n}")
    high, low = reading.max(axis=1), reading.min(axis=1)
    middle, size = 0.5 * (high + low), float(np.max(high - low)) / 2
    if size == 0:
        raise CoverageError("an ellipsoid fit must have readings that move; got constant readings on all axes")
    gram, total = _normal_equations(reading, middle, size)
    try:
        q = np.linalg.solve(gram, total)
    except np.linalg.LinAlgError:
        raise CoverageError(coverage_message(reading)) from None
    d = np.array([[q[0], q[3], q[4]], [q[3], q[1], q[5]], [q[4], q[5], q[2]]])
    if np.linalg.eigvalsh(d)[0] <= 0:
        raise CoverageError(coverage_message(reading))
    b = -np.linalg.solve(d, q[6:])
    upper = np.linalg.cholesky(d / (1.0 + b @ d @ b)).T  # (h-b)^T D (h-b) = 1 + b^T D b
    return Ellipsoid(magnitude * upper / size, middle + size * b)


def _normal_equations(reading: np.ndarray, middle: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Of x x, y y, z z, 2xy, 2xz, 2yz, 2x, 2y, 2z (h^T D h and the linear part of 4.14) against one: (9, 9), (9,)."""
    gram, n = np.zeros((10, 10)), reading.shape[1]
    rows = np.ones((10, min(n, CHUNK)))
    for at in range(0, n, CHUNK):
        h = (reading[:, at : at + CHUNK] - middle[:, None]) / size
        part = rows[:, : h.shape[1]]
        np.multiply(h, h, out=part[:3])
        np.multiply(h, 2.0, out=part[6:9])
        np.multiply(part[6], h[1:], out=part[3:5])
        np.multiply(part[7], h[2], out=part[5])
        gram += part @ part.T
    return gram[:9, :9], gram[:9, 9]


def coverage_message(reading: np.ndarray) -> str:
    """What the readings lack, in a sentence: they fill a point, a line or a plane instead of a closed surface."""
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(reading)), 0.0))[::-1]
    of_largest = spread / max(spread[0], 1e-300)
    return (
        "the readings must surround the sensor for an ellipsoid fit: turn it through all directions; got a cloud whose "
        f"second and third extents are {100 * of_largest[1]:.0f} % and {100 * of_largest[2]:.0f} % of the first"
    )
