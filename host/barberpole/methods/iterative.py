"""The iterative ellipsoid (thesis 4.21-4.22): each round fits the points it already has on the unit sphere.

    (A, B) = argmin sum |A h + B - h / |h||²                                         (4.21)
    h <- A h + B                                                                     (4.22)

Each round is linear least squares. Its fixed point minimises sum (|h| - 1)² over the affine maps of the readings, up
to the shrinking below; it needs no quadric, and a start only to centre the readings. Noise shrinks A a little every
round (a regression against a noisy regressor), by about sigma²/K²; the radius is put back at the end.
"""

from typing import NamedTuple

import numpy as np

from barberpole.errors import InputError
from barberpole.fit.ellipsoid import MIN_SAMPLES, Ellipsoid, coverage_message

ROUNDS = 500  # a round takes off one third or more of what is left; strong distortion starts slowly
SETTLED = 1e-9  # change of the map, relative to the unit matrix, that ends the rounds
THINNEST = 1e-3  # smallest over largest variance of the readings that still is a closed surface


class Rounds(NamedTuple):
    """The ellipsoid, how many rounds of (4.21) it took, and whether they had settled."""

    shape: Ellipsoid
    rounds: int
    settled: bool


def iterative(reading: np.ndarray, magnitude: float = 1.0) -> Rounds:
    """(4.21)-(4.22) through readings (3, n) in LSB, scaled so that the mean |H| is `magnitude`; rotation left out.

    Raises InputError where the readings do not surround the sensor.
    """
    if reading.shape[1] < MIN_SAMPLES:
        raise InputError(f"the iterative ellipsoid must have at least {MIN_SAMPLES} samples; got {reading.shape[1]}")
    a, b = _first(reading)
    scatter, mean, n = _moments(reading)
    settled, count = False, 0
    while count < ROUNDS and not settled:
        count += 1
        h = a @ reading + b[:, None]
        step, shift = _round(h, scatter, mean, n, a, b)
        a, b = step @ a, step @ b + shift
        settled = float(np.abs(step - np.eye(3)).max() + np.abs(shift).max()) < SETTLED
    return Rounds(_without_rotation(reading, a, b, magnitude), count, settled)


def _first(reading: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middle of the range to zero, root mean square to one."""
    middle = 0.5 * (reading.max(axis=1) + reading.min(axis=1))
    spread = np.linalg.eigvalsh(np.cov(reading))
    if not spread[0] > THINNEST * spread[-1]:
        raise InputError(coverage_message(reading))
    size = float(np.sqrt(np.mean(np.sum((reading - middle[:, None]) ** 2, axis=0))))
    return np.eye(3) / size, -middle / size


def _moments(reading: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Sums that every round needs: h h^T (3, 3), h (3,), n."""
    return reading @ reading.T, reading.sum(axis=1), reading.shape[1]


def _round(h: np.ndarray, scatter, mean, n: int, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A and B of (4.21) for the points h (3, n) = a reading + b; their own moments follow from the readings'."""
    target = h / np.sqrt(np.einsum("ik,ik->k", h, h))
    first = a @ mean + n * b
    second = a @ scatter @ a.T + np.outer(a @ mean, b) + np.outer(b, a @ mean) + n * np.outer(b, b)
    left = np.block([[second, first[:, None]], [first[None], np.array([[float(n)]])]])
    right = np.hstack([target @ h.T, target.sum(axis=1)[:, None]])
    solved = np.linalg.solve(left, right.T).T
    return solved[:, :3], solved[:, 3]


def _without_rotation(reading, a: np.ndarray, b: np.ndarray, magnitude: float) -> Ellipsoid:
    """The upper triangular L with L^T L = A^T A (4.15-4.18), at the mean radius `magnitude`."""
    upper = np.linalg.cholesky(a.T @ a).T
    centre = -np.linalg.solve(a, b)
    radius = float(np.mean(np.linalg.norm(upper @ (reading - centre[:, None]), axis=0)))
    return Ellipsoid(upper * magnitude / radius, centre)
