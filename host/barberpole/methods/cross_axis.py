"""Compensation of the cross-field by the published search (thesis 5.2-5.3): a grid for alpha, beta, gamma.

    unflipped   V_ideal = V sqrt(((H_k + a H_e)² + H_s²) / (H_k² + H_s²))            (5.6, 5.10-5.12)
    flipped     V_ideal = V (H_k² - a² H_e²) / H_k²                                  (5.9, 5.15-5.17)

H_s is the field that a bridge measures, H_e that along its easy axis, a its factor alpha, beta or gamma: what the
assumed H_k is wrong by, with the sign of the easy axis. For each triple the corrected readings go through the two-step
ellipsoid, and the triple with the least sum over intervals of one second of the peak-to-peak of |H| wins (5.3.3).
The grid begins wide and is then laid finer around the best triple. H_s and H_e are readings less the centre of the
first ellipsoid, over the gains. Shapes: fields (3, n) in µT; H_k (3,) in µT.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from barberpole.errors import InputError, must
from barberpole.fit.ellipsoid import Ellipsoid, algebraic
from barberpole.methods.quality import FOLDS, stretches
from barberpole.units import gauss_to_ut

ANISOTROPY_UT = tuple(gauss_to_ut(h) for h in (9.0, 8.5, 10.0))  # eq. 5.13, Oe
INTERVAL_S = 1.0  # of a peak-to-peak value (5.3.3)
INTERVAL_ROWS = 50  # where the log has no time
WIDEST = 2.0  # first grid: -2 to 2
COARSE, FINE, ROUNDS = 9, 3, 7  # points an axis of the first grid and of the finer ones, each half the size
NEAR, ROUNDS_NEAR = 0.125, 4  # of the first pitch, and grids, where a triple is known already


@dataclass(frozen=True)
class Search:
    """The best triple, the sums S of peak-to-peak before and after (µT), and the ellipsoid of the corrected readings.

    rms_before, rms_after   of |H| - K, µT
    """

    factors: np.ndarray
    flipped: bool
    sum_before_ut: float
    sum_after_ut: float
    rms_before_ut: float
    rms_after_ut: float
    shape: Ellipsoid
    ground: "Ground"

    def norm(self, reading: np.ndarray) -> np.ndarray:
        """|H| (n,) in µT of compensated readings (3, n) in LSB."""
        return _norm(self.shape, self.ground.corrected(reading, self.factors, self.flipped))


@dataclass(frozen=True)
class Ground:
    """The first ellipsoid, its gains (3, 1) in LSB/µT, H_k (3, 1) in µT and easy axes: what a triple is applied to."""

    shape: Ellipsoid
    gain: np.ndarray
    anisotropy_ut: np.ndarray
    easy_axis: tuple[int, int, int]

    def corrected(self, reading: np.ndarray, factors: np.ndarray, is_flipped: bool) -> np.ndarray:
        """Readings (3, n) in LSB without their cross-field."""
        own = (reading - self.shape.centre[:, None]) / self.gain
        law = flipped if is_flipped else unflipped
        field = law(own, own, factors[:, None] * own[list(self.easy_axis)], self.anisotropy_ut)
        return self.shape.centre[:, None] + self.gain * field


def unflipped(v: np.ndarray, own: np.ndarray, easy: np.ndarray, anisotropy: np.ndarray | float) -> np.ndarray:
    """Eq. 5.6 with its sign restored; `easy` already carries the factor. All in one unit, arrays (n,) or (3, n)."""
    return v * np.sqrt(((anisotropy + easy) ** 2 + own**2) / (anisotropy**2 + own**2))


def flipped(v: np.ndarray, own: np.ndarray, easy: np.ndarray, anisotropy: np.ndarray | float) -> np.ndarray:
    """Eq. 5.9; `own` does not enter."""
    return v * (anisotropy**2 - easy**2) / anisotropy**2


def intervals(n: int, t_s: np.ndarray | None) -> np.ndarray:
    """First rows (k,) of the intervals of one second, or of INTERVAL_ROWS where there is no time that goes on."""
    if t_s is None or not t_s[-1] - t_s[0] > 2 * INTERVAL_S:
        return np.arange(0, n, INTERVAL_ROWS)
    return np.unique(np.floor((t_s - t_s[0]) / INTERVAL_S), return_index=True)[1]


def peak_to_peak_sum(norm: np.ndarray, first: np.ndarray) -> float:
    """S of 5.3.3: the sum over intervals of largest minus smallest."""
    return float(np.sum(np.maximum.reduceat(norm, first) - np.minimum.reduceat(norm, first)))


def search(
    reading: np.ndarray,
    magnitude: float,
    anisotropy_ut: np.ndarray,
    easy_axis: tuple[int, int, int],
    first: np.ndarray,
    is_flipped: bool,
    near: np.ndarray | None = None,
) -> Search:
    """The grid search on readings (3, n) in LSB. Raises InputError where the readings do not surround the sensor.

    near: a triple to search around, with the finer grids alone.
    """
    shape = algebraic(reading, magnitude)
    gain = np.linalg.norm(np.linalg.inv(shape.upper), axis=1)[:, None]
    ground = Ground(shape, gain, np.asarray(anisotropy_ut, float)[:, None], easy_axis)
    own = (reading - shape.centre[:, None]) / gain
    easy, hk = own[list(easy_axis)], ground.anisotropy_ut
    law = flipped if is_flipped else unflipped

    def cost(factors: np.ndarray) -> float:
        field = law(own, own, factors[:, None] * easy, hk)
        try:
            return peak_to_peak_sum(_norm(algebraic(field, magnitude), field), first)
        except InputError:
            return np.inf

    best = _descend(cost, is_flipped, near)
    field = law(own, own, best[:, None] * easy, hk)
    final = algebraic(field, magnitude)
    before, after = _norm(shape, reading), _norm(final, field)
    return Search(
        best,
        is_flipped,
        peak_to_peak_sum(before, first),
        peak_to_peak_sum(after, first),
        _rms(before - magnitude),
        _rms(after - magnitude),
        Ellipsoid(final.upper / gain[:, 0], shape.centre + gain[:, 0] * final.centre),
        ground,
    )


def heldout(reading: np.ndarray, magnitude: float, first: np.ndarray, found: Search) -> np.ndarray:
    """(n,) µT: |H| - K of each reading (3, n) by a search, around the triple found, over the intervals without it."""
    interval = np.searchsorted(first, np.arange(reading.shape[1]), side="right") - 1
    fold, left = stretches(first.size)[interval], np.empty(reading.shape[1])
    ground = found.ground
    for out in (fold == k for k in range(FOLDS) if np.any(fold == k)):
        starts = np.unique(interval[~out], return_index=True)[1]
        hk, easy = ground.anisotropy_ut[:, 0], ground.easy_axis
        by = search(reading[:, ~out], magnitude, hk, easy, starts, found.flipped, found.factors)
        left[out] = by.norm(reading[:, out]) - magnitude
    return left


def _descend(cost, is_flipped: bool, near: np.ndarray | None) -> np.ndarray:
    """The best triple: a wide grid, then grids of half the pitch around the best so far. (5.15) is even in a."""
    low = 0.0 if is_flipped else -WIDEST
    axis = np.linspace(low, WIDEST, COARSE)
    pitch, rounds = axis[1] - axis[0], ROUNDS
    if near is None:
        best, least = _best(cost, product(axis, repeat=3), np.zeros(3), np.inf)
    else:
        best, least = near, cost(near)
        pitch, rounds = NEAR * pitch, ROUNDS_NEAR
    for _ in range(rounds):
        pitch *= 0.5
        around = (np.linspace(b - pitch, b + pitch, FINE) for b in best)
        best, least = _best(cost, product(*around), best, least)
    return best


def _best(cost, triples: Iterator, best: np.ndarray, least: float) -> tuple[np.ndarray, float]:
    for triple in triples:
        trial = np.array(triple)
        found = cost(trial)
        if found < least:
            best, least = trial, found
    return best, least


def _norm(shape: Ellipsoid, reading: np.ndarray) -> np.ndarray:
    return np.linalg.norm(shape.field(reading), axis=0)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def require_anisotropy(anisotropy_ut: np.ndarray, magnitude_ut: float) -> None:
    """Raise InputError where the field is not small against H_k, as (5.6) and (5.9) take it to be."""
    if not np.all(np.asarray(anisotropy_ut) > 2.0 * magnitude_ut):
        got = f"{min(anisotropy_ut):.4g} µT in a field of {magnitude_ut:.4g} µT"
        raise InputError(must("the anisotropy field", "more than twice the field", got))
