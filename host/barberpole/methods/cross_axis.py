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
from barberpole.units import gauss_to_ut

ANISOTROPY_UT = tuple(gauss_to_ut(h) for h in (9.0, 8.5, 10.0))  # eq. 5.13, Oe
INTERVAL_S = 1.0  # of a peak-to-peak value (5.3.3)
INTERVAL_ROWS = 50  # where the log has no time
WIDEST = 2.0  # first grid: -2 to 2
COARSE, FINE, ROUNDS = 9, 3, 7  # points an axis of the first grid and of the finer ones, each half the size


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
) -> Search:
    """The grid search on readings (3, n) in LSB. Raises InputError where the readings do not surround the sensor."""
    shape = algebraic(reading, magnitude)
    gain = np.linalg.norm(np.linalg.inv(shape.upper), axis=1)[:, None]
    own = (reading - shape.centre[:, None]) / gain
    easy, hk = own[list(easy_axis)], np.asarray(anisotropy_ut, float)[:, None]
    law = flipped if is_flipped else unflipped

    def cost(factors: np.ndarray) -> float:
        field = law(own, own, factors[:, None] * easy, hk)
        try:
            return peak_to_peak_sum(_norm(algebraic(field, magnitude), field), first)
        except InputError:
            return np.inf

    best = _descend(cost, is_flipped)
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
    )


def _descend(cost, is_flipped: bool) -> np.ndarray:
    """The best triple: a wide grid, then grids of half the pitch around the best so far. (5.15) is even in a."""
    low = 0.0 if is_flipped else -WIDEST
    axis = np.linspace(low, WIDEST, COARSE)
    best, least = _best(cost, product(axis, repeat=3), np.zeros(3), np.inf)
    pitch = axis[1] - axis[0]
    for _ in range(ROUNDS):
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
