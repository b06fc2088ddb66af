"""How the clocks of sensor and driver lie to each other, from the field that both know of.

    t_d = t + shift + drift (t - middle)         the driver's clock at the sensor's time t                       (1)

At a trial shift the readings are regressed on the currents of the points that were held then; what is left over the
variance is least where the clocks agree. A row in the wrong hold adds to it, so the least is a plateau as wide as the
gap between rows, and its middle is taken. Where the driver repeats its turn, shifts of whole turns do as well: the
one with most rows in common is taken, and the field is the same.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from barberpole.errors import InputError, must
from barberpole.imcs.driven import Driven

STRETCH_S = 10.0  # of rows for one shift: two crystals part by a millisecond or two in it
LONG_S = 6.0 * STRETCH_S  # of a log whose drift can be seen, and matters
MOST_ROWS = 300  # of the search over all shifts
FEWEST_ROWS = 8  # of those
MOST_SHIFTS = 200_000  # of a quarter point: half a day of points of one second has as many
CANDIDATES = 6  # whole turns of the driver among them
SAME = 0.03  # of the variance, by which one turn's shift may be worse than another's
FINE_S = 2e-4
MOST_FINE = 5000  # of those within a point
PLATEAU = 1.02  # times the least, that is still the plateau
IN_COMMON = 0.5  # of the rows, that a shift must lay within the driver's record
FOLLOWED = 0.3  # of the variance that may be left; a sensor in the coils leaves what rows at steps do, some per cent
LARGEST_DRIFT = 2e-3  # between two crystals


@dataclass(frozen=True)
class Clocks:
    """Equation 1, and the part of the readings' variance that is left there."""

    shift_s: float
    drift: float
    middle_s: float
    left: float

    def driver_s(self, t_s: np.ndarray) -> np.ndarray:
        """The driver's time of the sensor's times (n,)."""
        return t_s + self.shift_s + self.drift * (t_s - self.middle_s)


def agree(y: np.ndarray, t_s: np.ndarray, driven: Driven, where: object) -> Clocks:
    """The clocks of readings (3, n) at t_s (n,). Raises InputError where the readings do not follow the currents."""
    middle = 0.5 * float(t_s[0] + t_s[-1])
    rows = _stretch(t_s, middle)
    shift = _fine(y, t_s, driven, rows, _coarse(y, t_s, driven, rows))
    drift = 0.0
    common = np.flatnonzero((t_s + shift >= driven.from_s[0]) & (t_s + shift <= driven.to_s[-1]))
    if not common.size:
        raise InputError(must("the readings", "such as follow the driver's currents", "none at the best shift", where))
    if t_s[common[-1]] - t_s[common[0]] > LONG_S:
        drift, shift = _drift(y, t_s, driven, shift, common)
        shift += drift * (middle - 0.5 * float(t_s[common[0]] + t_s[common[-1]]))
    left = _left(y[:, rows], t_s[rows] + shift + drift * (t_s[rows] - middle), driven)
    if not left < FOLLOWED or abs(drift) > LARGEST_DRIFT:
        got = f"{100 * left:.0f} % of their variance left at the best shift, {1e6 * drift:.0f} ppm of drift"
        raise InputError(must("the readings", "such as follow the driver's currents", got, where))
    return Clocks(shift, drift, middle, left)


def _stretch(t_s: np.ndarray, about_s: float) -> np.ndarray:
    return np.flatnonzero(np.abs(t_s - about_s) <= 0.5 * STRETCH_S)


def _coarse(y: np.ndarray, t_s: np.ndarray, driven: Driven, rows: np.ndarray) -> float:
    """The best shift of all, to a quarter of a point."""
    if rows.size < FEWEST_ROWS:
        got = f"{rows.size} within {STRETCH_S:g} s"
        raise InputError(must("the log", f"one with {FEWEST_ROWS} rows about its middle", got, driven.path))
    few = rows[:: -(-rows.size // MOST_ROWS)]
    first, last = driven.from_s[0] - t_s[few[-1]], driven.to_s[-1] - t_s[few[0]]
    if not 0 < 4.0 * (last - first) / driven.pitch_s < MOST_SHIFTS:
        got = f"{last - first:.4g} s of rows and points, {driven.pitch_s:.4g} s a point"
        raise InputError(must("log and record", "of one day, with points of one length", got, driven.path))
    shifts = np.arange(first, last, 0.25 * driven.pitch_s)
    left = np.array([_left(y[:, few], t_s[few] + s, driven) for s in shifts])
    tried = [_fine(y, t_s, driven, few, shift) for shift in _lowest(shifts, left, driven.pitch_s)]
    found = np.array([_left(y[:, few], t_s[few] + s, driven) for s in tried])
    return max(
        (s for s, f in zip(tried, found, strict=True) if f <= found.min() + SAME), key=partial(_common_s, t_s, driven)
    )


def _lowest(shifts: np.ndarray, left: np.ndarray, apart_s: float) -> list[float]:
    """The best few shifts that are not neighbours."""
    chosen: list[float] = []
    for k in np.argsort(left):
        if len(chosen) == CANDIDATES:
            break
        if all(abs(shifts[k] - other) > apart_s for other in chosen):
            chosen.append(float(shifts[k]))
    return chosen


def _common_s(t_s: np.ndarray, driven: Driven, shift: float) -> float:
    """How long sensor and driver were at work together, s."""
    return min(t_s[-1] + shift, driven.to_s[-1]) - max(t_s[0] + shift, driven.from_s[0])


def _fine(y: np.ndarray, t_s: np.ndarray, driven: Driven, rows: np.ndarray, about_s: float) -> float:
    """The middle of the plateau near a shift."""
    step_s = max(FINE_S, driven.pitch_s / MOST_FINE)
    shifts = about_s + np.arange(-0.5 * driven.pitch_s, 0.5 * driven.pitch_s, step_s)
    left = np.array([_left(y[:, rows], t_s[rows] + s, driven) for s in shifts])
    least = int(np.argmin(left))
    flat = left <= PLATEAU * left[least] + 1e-9
    low, high = least, least
    while low > 0 and flat[low - 1]:
        low -= 1
    while high < len(flat) - 1 and flat[high + 1]:
        high += 1
    return float(0.5 * (shifts[low] + shifts[high]))


def _drift(y: np.ndarray, t_s: np.ndarray, driven: Driven, shift: float, common: np.ndarray) -> tuple[float, float]:
    """Drift, and shift at its middle, from the beginning and the end of the rows that both know of."""
    ends = (t_s[common[0]] + 0.5 * STRETCH_S, t_s[common[-1]] - 0.5 * STRETCH_S)
    early, late = (_fine(y, t_s, driven, _stretch(t_s, float(end)), shift) for end in ends)
    return (late - early) / float(ends[1] - ends[0]), 0.5 * (early + late)


def _left(y: np.ndarray, driver_s: np.ndarray, driven: Driven) -> float:
    """Part of the variance of readings (3, n) that the currents held at those times do not explain; 1 where too few
    rows lie within the record."""
    hold = np.searchsorted(driven.to_s, driver_s)  # the field steps where a hold ends
    there = (driver_s >= driven.from_s[0]) & (hold < driven.to_s.size)
    if there.sum() < IN_COMMON * there.size or there.sum() < FEWEST_ROWS:
        return 1.0
    i, h = driven.current_ma[:, hold[there]], y[:, there]
    i, h = i - i.mean(axis=1, keepdims=True), h - h.mean(axis=1, keepdims=True)
    gram = i @ i.T
    if np.linalg.cond(gram) > 1e9:
        return 1.0
    cross = h @ i.T
    explained = np.sum(np.linalg.solve(gram, cross.T).T * cross)
    return float(1.0 - explained / max(np.sum(h * h), 1e-300))
