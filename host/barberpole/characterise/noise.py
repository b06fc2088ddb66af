"""Noise of a sensor at rest: standard deviation, density by Welch, white or 1/f, outliers (article 3.3, fig. 8)."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import welch

from barberpole.errors import InputError, must
from barberpole.fit.noise import estimate

SEGMENTS = 8  # of a record, half overlapping
LEAST_ROWS = 256
AROUND_1_HZ = 2.0 ** (1.0 / 3.0)  # the density at 1 Hz is the mean over a third of an octave either way
OUTLIER = 5.0  # robust standard deviations: a normal reading lies beyond in 6e-7
MAD = 1.4826  # standard deviation over median absolute deviation of a normal distribution


@dataclass(frozen=True)
class NoiseFigures:
    """Of three axes at rest, in the unit of the readings (u).

    std, std_stderr (3,) u; frequency_hz (k,), density (3, k) u/√Hz one-sided; at_1_hz, at_1_hz_stderr (3,)
    white (3,) u/√Hz and corner_hz of density² = white² (1 + (corner / f)^exponent), corner 0 for white noise
    outliers (3,) part of the readings that lie beyond
    """

    std: np.ndarray
    std_stderr: np.ndarray
    frequency_hz: np.ndarray
    density: np.ndarray
    at_1_hz: np.ndarray
    at_1_hz_stderr: np.ndarray
    white: np.ndarray
    corner_hz: float
    exponent: float
    outliers: np.ndarray

    def scaled(self, per_axis: np.ndarray) -> "NoiseFigures":
        """The same with each axis in another unit: factors (3,)."""
        names = ("std", "std_stderr", "at_1_hz", "at_1_hz_stderr", "white")
        changed = {name: getattr(self, name) * per_axis for name in names}
        return replace(self, density=self.density * per_axis[:, None], **changed)

    def outlier_stderr(self, n: int) -> np.ndarray:
        """(3,) standard errors of the outlier rates over n readings; of one in n where none was seen."""
        return np.sqrt(np.maximum(self.outliers, 1.0 / n) / n)


def noise_figures(y: np.ndarray, rate_hz: float) -> NoiseFigures:
    """From readings (3, n) at rest, evenly sampled. Raises InputError for short records or rates below 2.5 Hz."""
    n = y.shape[1]
    if n < LEAST_ROWS or rate_hz < 2.0 * AROUND_1_HZ:
        got = f"{n} rows at {rate_hz:.3g} Hz"
        raise InputError(must("a noise record", f"at least {LEAST_ROWS} rows at 2.6 Hz or more", got))
    beyond = outliers(y)
    clean = np.where(beyond, np.median(y, axis=1, keepdims=True), y)
    length = max(min(n // (SEGMENTS // 2), n), 64)
    f, power = welch(clean, rate_hz, nperseg=length, axis=1)
    found = estimate(clean, "rest")
    near = (f >= 1.0 / AROUND_1_HZ) & (f <= AROUND_1_HZ)
    near = near if near.any() else np.arange(len(f)) == np.argmin(np.abs(f - 1.0))
    level, free = power[:, near].mean(axis=1), _independent(n, length, int(near.sum()))
    correlated = _correlated(found.corner, n)
    std = clean.std(axis=1, ddof=1)
    return NoiseFigures(
        std,
        std * np.sqrt(correlated / (2.0 * n)),
        f[1:],
        np.sqrt(power[:, 1:]),
        np.sqrt(level),
        0.5 * np.sqrt(level) / np.sqrt(free),
        np.sqrt(2.0 * found.white / rate_hz),
        found.corner * rate_hz,
        found.exponent,
        beyond.mean(axis=1),
    )


def _independent(n: int, length: int, bins: int) -> float:
    """Independent values in a mean of this many bins over half-overlapping segments (Welch 1967: 9/11 of 2n/length)."""
    return max(2.0 * n / length * 9.0 / 11.0, 1.0) * max(bins / 1.5, 1.0)  # Hann's lobe is 1.5 bins wide


def _correlated(corner: float, n: int) -> float:
    """How many times the variance of a variance exceeds that of white noise, from the spectrum (corner in 1/sample)."""
    if corner == 0.0:
        return 1.0
    shape = 1.0 + corner / (np.arange(1, n // 2 + 1) / n)
    return float(np.mean(shape**2) / np.mean(shape) ** 2)


def outliers(y: np.ndarray) -> np.ndarray:
    """Mask (3, n) of readings beyond OUTLIER robust standard deviations of the running level of their neighbours."""
    level = np.median(np.stack([np.roll(y, k, axis=1) for k in (-2, -1, 0, 1, 2)]), axis=0)
    apart = np.abs(y - level)
    about = np.abs(y - np.median(y, axis=1, keepdims=True))
    rough = np.maximum(MAD * np.median(about, axis=1, keepdims=True), _step(y))
    spread = np.sqrt(np.mean(about**2, axis=1, keepdims=True, where=about <= OUTLIER * rough))
    return apart > OUTLIER * np.maximum(spread, _step(y) / np.sqrt(12.0))


def _step(y: np.ndarray) -> np.ndarray:
    """(3, 1): the step of a converter, 1 where the readings are whole numbers, else 0."""
    return np.all(y == np.round(y), axis=1, keepdims=True).astype(float)
