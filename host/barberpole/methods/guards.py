"""What keeps a closed-form method from an answer that is finite, confident and wrong.

A low residual guards nothing: few rows, a ring thick with noise or a small cap are fitted well by a wrong ellipsoid.
So the answer itself is asked how well these rows determine it (Cramér-Rao), and the rows whether they are what they
seem.
"""

import numpy as np

from barberpole.errors import InputError, must
from barberpole.fit.ellipsoid import Ellipsoid, coverage_message
from barberpole.fit.spikes import NO_SPIKES, said_of_spikes
from barberpole.methods.ellipsoid import certainty

LEAST_ROWS = 18  # twice the nine unknowns: with fewer the residual says too little about the noise
CERTAIN = 0.02  # of the field: 1 µT in 50 is a calibration's worth of error
THICKNESS = (
    4.0  # thinnest extent of the readings over their noise; a ring thick with noise has 1, a sphere at 3 % has 19
)
GAIN_RATIO = 8.0  # between the axes of one sensor; more is a flat cloud drawn out into a sphere
FILLED = 20.0  # %, RMS of |H|/K - 1: a ball of noise has 42, an evenly filled one 26, a bad real log 3
LARGEST_LSB = 1e12  # of a reading; no converter has 40 bits
SPIKE = 10.0  # residual over the robust deviation that makes a row that stands alone a spike
FEW = 0.05  # of the rows, that may be called spikes
BESIDE = 5  # rows on either side that a spike stands out from
SPIKES_SHARE = 0.5  # of the sum of squares: what a few rows must hold to rule the fit
WINDOW = 10  # rows that are taken together
LEAST_WINDOWS = 20
APART = 10.0  # times the usual power of a window
SHORT = 0.2  # of the log, in which a stretch must lie
HELD = 0.6  # of the sum of squares that it must hold
ROUNDING = 1e-6  # of the range: below, a residual is arithmetic


def require_rows(n: int, least: int, what: str, where: object) -> None:
    """Raise InputError with fewer samples than a method needs."""
    if n < least:
        raise InputError(must(what, f"given at least {least} samples", f"{n}", where))


def require_moving(reading: np.ndarray, what: str, where: object, every: bool = False) -> None:
    """Raise InputError for readings (3, n) that never move (`every`: on any axis), or that no converter gives."""
    if not np.all(np.abs(reading) < LARGEST_LSB):
        raise InputError(must("the readings", f"below {LARGEST_LSB:g} LSB", f"{np.abs(reading).max():g}", where))
    still = [
        axis for axis, low, high in zip("xyz", reading.min(axis=1), reading.max(axis=1), strict=True) if low == high
    ]
    if len(still) == 3 or (every and still):
        got = f"the same value in every row on {', '.join(still)} (a stuck bridge or converter)"
        raise InputError(must(what, "given readings that move", got, where))


def require_determined(shape: Ellipsoid, reading: np.ndarray, known: float) -> None:
    """Raise InputError where readings (3, n) in LSB only suggest this ellipsoid of radius `known`: a cloud that is
    filled, flat and drawn out, as thin as its noise, or too small a part of the surface."""
    field = shape.field(reading)
    off = np.linalg.norm(field, axis=0) / known - 1.0
    gain = np.linalg.norm(np.linalg.inv(shape.upper), axis=1)
    filled = 100.0 * float(np.sqrt(np.mean(off**2))) > FILLED
    if filled or gain.max() > GAIN_RATIO * gain.min():
        raise InputError(coverage_message(reading))
    sigma, worst = _certainty(shape, reading, known)
    thinnest = float(np.sqrt(max(np.linalg.eigvalsh(np.cov(reading))[0], 0.0)))
    if thinnest < THICKNESS * sigma or not worst < CERTAIN:
        how = f"{100 * worst:.0f} %" if worst < 1.0 else "nothing"
        raise InputError(f"{coverage_message(reading)}, which leaves the answer certain to {how} of the field")


def _certainty(shape: Ellipsoid, reading: np.ndarray, known: float) -> tuple[float, float]:
    """Noise in LSB, and the largest standard error of L or b by what it does to the field, over K; infinite where a
    direction is unseen."""
    try:
        sigma, covariance = certainty(reading, shape, known)
    except np.linalg.LinAlgError:
        return 0.0, np.inf
    stderr, diagonal = np.sqrt(np.diag(covariance)), np.diag(shape.upper)
    columns = np.array([0, 1, 2, 1, 2, 2])  # of L11 L12 L13 L22 L23 L33
    found = np.concatenate([stderr[:6] / diagonal[columns], stderr[6:] * diagonal / known])
    return sigma, float(found.max()) if np.all(np.isfinite(found)) else np.inf


def require_no_spikes(left: np.ndarray, size: float, where: object) -> None:
    """Raise InputError where rows that stand alone rule a fit: `left` (n,) or (3, n) is what it left of each row.

    size: range of what was fitted, in the unit of `left`. What bends over many rows in turn is missing physics and no
    spike.
    """
    far = np.linalg.norm(np.atleast_2d(left), axis=0)
    deviation = max(1.4826 * float(np.median(far)), ROUNDING * size)
    out = np.flatnonzero(far > SPIKE * deviation)
    if not 0 < out.size <= FEW * far.size:
        return
    around = np.clip(out[:, None] + np.arange(-BESIDE, BESIDE + 1), 0, far.size - 1)
    alone = out[far[out] > SPIKE * np.median(far[around], axis=1)]
    if np.sum(far[alone] ** 2) > SPIKES_SHARE * np.sum(far**2):
        mask = np.zeros(far.size, bool)
        mask[alone] = True
        raise InputError(must("the readings", NO_SPIKES, said_of_spikes(mask), where))


def require_no_stretch(left: np.ndarray, where: object) -> None:
    """Raise InputError where one short stretch holds nearly all of what a fit left, (n,) or (3, n): a magnet passed
    by. What is wrong in it must go the same way for many rows; noise that rises and falls does not."""
    left = np.atleast_2d(left)
    count = left.shape[1] // WINDOW
    if count < LEAST_WINDOWS:
        return
    parts = left[:, : count * WINDOW].reshape(len(left), count, WINDOW)
    power = WINDOW * np.sum(parts.mean(axis=2) ** 2, axis=0)
    noise = np.sum(np.mean(np.diff(parts, axis=2) ** 2, axis=2), axis=0) / 2.0
    high = np.flatnonzero((power > APART * np.median(power)) & (power > APART * noise))
    if not high.size:
        return
    first, last = int(high[0]), int(high[-1]) + 1
    held = float(np.sum(power[first:last]))
    if last - first <= SHORT * count and held > HELD * float(np.sum(left**2)):
        wanted = "of one piece (take those rows out: did something magnetic pass by?)"
        got = f"rows {first * WINDOW + 1} to {last * WINDOW} that lie apart from all others"
        raise InputError(must("the readings", wanted, got, where))
