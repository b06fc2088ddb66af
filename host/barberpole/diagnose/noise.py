"""The sensor's own noise: white plus a power law, and how to make residuals white with it.

    S_i(f) = w_i (1 + (f_c / f)^a)                                                   (1)

f in cycles a sample, w_i (LSB^2) the white level of each axis, f_c the corner, common to the axes of one sensor.
Fitted by Whittle's likelihood to the periodogram, best that of the sensor at rest.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.fft import irfft, rfft

EXPONENTS = np.linspace(0.6, 2.0, 8)
CORNERS = np.geomspace(2e-4, 2.0, 25)  # cycles a sample
BINS = 64  # of the periodogram, logarithmic: enough for three parameters
COLOURED = 10.0  # gain in -2 log likelihood that a corner must bring, beside two log n


@dataclass(frozen=True)
class Noise:
    """Eq. (1): white (m,) in LSB^2 a channel, corner in cycles a sample (0: white). source: where it was measured."""

    white: np.ndarray
    corner: float = 0.0
    exponent: float = 1.0
    source: str = "residual"

    @property
    def coloured(self) -> bool:
        return self.corner > 0.0

    def shape(self, f: np.ndarray) -> np.ndarray:
        """S / w at frequencies f > 0."""
        return power_law(f, self.corner, self.exponent)

    def rms(self, n: int) -> float:
        """RMS in LSB over a record of n samples, all channels together."""
        return float(np.sqrt(np.mean(self.white) * np.mean(self.shape(np.arange(1, n // 2 + 1) / n))))

    def at_rate(self, ratio: float) -> "Noise":
        """The same sensor sampled `ratio` times as often."""
        return replace(self, corner=self.corner / ratio)

    def common(self) -> "Noise":
        """The same for one channel: the mean of the axes."""
        return replace(self, white=np.array([float(np.mean(self.white))]))

    def whiten(self, channel: int, rows: np.ndarray) -> np.ndarray:
        """Rows (K, n) of one channel, divided by the root of its spectrum: unit variance, no correlation."""
        scale = 1.0 / np.sqrt(self.white[channel])
        if not self.coloured:
            return rows * scale
        n = rows.shape[1]
        return irfft(rfft(rows, axis=1) * (scale / np.sqrt(self.shape(frequencies(n)))), n, axis=1)


def power_law(f: np.ndarray, corner: float, exponent: float) -> np.ndarray:
    """1 + (corner / f)^exponent."""
    return 1.0 + (corner / f) ** exponent if corner > 0 else np.ones_like(f)


def frequencies(n: int) -> np.ndarray:
    """Those of rfft, in cycles a sample; half a cycle a record stands for the mean."""
    f = np.arange(n // 2 + 1) / n
    f[0] = 0.5 / n
    return f


def estimate(channels: np.ndarray, source: str, slowest: int = 1, normal: np.ndarray | None = None) -> Noise:
    """Noise of residuals (m, n), without the frequencies below `slowest` periods a record.

    normal (3, n): of a scalar residual, along which the noise of the three axes was taken while the sensor turned.
    """
    n = channels.shape[1]
    bins = _edges(n, slowest)
    f = frequencies(n)
    power = np.abs(rfft(channels - channels.mean(axis=1, keepdims=True), axis=1)) ** 2 / n
    binned, weight = _binned(power, bins), np.diff(bins).astype(float)
    turning = None if normal is None else _turning(normal)
    trials = [(0.0, 1.0)] + [(c, a) for c in CORNERS[CORNERS > 1.0 / n] for a in EXPONENTS]
    shapes = [_binned(_seen_turning(power_law(f, c, a), turning, n)[None], bins)[0] for c, a in trials]
    deviance = [_deviance(binned, weight, shape) for shape in shapes]
    best = int(np.argmin(deviance))
    if deviance[0] - deviance[best] < COLOURED + 2 * np.log(n):
        best = 0
    level = np.average(binned / shapes[best], axis=1, weights=weight)
    return Noise(level, *(float(v) for v in trials[best]), source=source)


def _turning(normal: np.ndarray) -> np.ndarray:
    """Mean product of the normal with itself k samples later, k = 0..n-1: what turning does to a correlation."""
    n = normal.shape[1]
    spectrum = np.abs(rfft(normal, 2 * n, axis=1)) ** 2
    return irfft(spectrum.sum(axis=0), 2 * n)[:n] / n


def _seen_turning(spectrum: np.ndarray, turning: np.ndarray | None, n: int) -> np.ndarray:
    """Expected periodogram of a scalar residual whose axes have this spectrum."""
    if turning is None:
        return spectrum
    correlation = irfft(spectrum, n)
    half = n // 2 + 1
    folded = correlation[:half] * turning[:half]
    out = 2.0 * np.real(rfft(folded, n)) - folded[0]
    return np.maximum(out, 1e-3 * spectrum)


def _deviance(power: np.ndarray, weight: np.ndarray, shape: np.ndarray) -> float:
    """-2 log Whittle likelihood, white level of each channel at its best value."""
    level = np.average(power / shape, axis=1, weights=weight)
    return 2.0 * float(np.sum(weight) * np.sum(np.log(level)) + len(level) * np.sum(weight * np.log(shape)))


def _edges(n: int, slowest: int) -> np.ndarray:
    """Logarithmic bins of the ordinates of a periodogram."""
    return np.unique(np.geomspace(slowest, (n + 1) // 2, BINS).astype(int))


def _binned(power: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Mean of (m, k) ordinates in bins."""
    return np.add.reduceat(power[:, : edges[-1]], edges[:-1], axis=1) / np.diff(edges)
