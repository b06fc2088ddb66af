"""The sensor's own noise: white plus a power law, and how to make readings white with it.

    S_i(f) = w_i (1 + (f_c / f)^a)                                                   (1)

f in cycles a sample, w_i (LSB^2) the white level of each axis, f_c the corner, common to the axes of one sensor.
Fitted by Whittle's likelihood to the periodogram, best that of the sensor at rest.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.fft import irfft, rfft

EXPONENTS = np.linspace(0.5, 2.0, 16)
CORNERS = np.geomspace(2e-4, 2.0, 49)  # cycles a sample
BINS = 64  # of the periodogram, logarithmic: enough for three parameters
COLOURED = 10.0  # gain in BIC that a corner must bring
SLOWEST = 8  # periods a record: below this a residual has lost power to the fit


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
        return 1.0 + (self.corner / f) ** self.exponent if self.coloured else np.ones_like(f)

    def rms(self, n: int) -> float:
        """RMS in LSB over a record of n samples, all channels together."""
        return float(np.sqrt(np.mean(self.white) * np.mean(self.shape(np.arange(1, n // 2 + 1) / n))))

    def at_rate(self, ratio: float) -> "Noise":
        """The same sensor sampled `ratio` times as often."""
        return replace(self, corner=self.corner / ratio)

    def whiten(self, channel: int, rows: np.ndarray) -> np.ndarray:
        """Rows (K, n) of one channel, divided by the root of its spectrum: unit variance, no correlation."""
        scale = 1.0 / np.sqrt(self.white[channel])
        if not self.coloured:
            return rows * scale
        n = rows.shape[1]
        f = np.arange(n // 2 + 1) / n
        f[0] = 0.5 / n
        return irfft(rfft(rows, axis=1) * (scale / np.sqrt(self.shape(f))), n, axis=1)


def estimate(channels: np.ndarray, source: str, slowest: int = 1) -> Noise:
    """Noise of residuals (m, n); frequencies below `slowest` periods a record are left out."""
    n = channels.shape[1]
    f, power, weight = _periodogram(channels - channels.mean(axis=1, keepdims=True), slowest)
    white = np.average(power, axis=1, weights=weight)
    flat = _deviance(power, weight, np.ones_like(f))
    deviance, corner, exponent = min(
        (_deviance(power, weight, 1.0 + (c / f) ** a), c, a) for c in CORNERS[1.0 / n < CORNERS] for a in EXPONENTS
    )
    if flat - deviance < COLOURED + 2 * np.log(n):
        return Noise(white, source=source)
    level = np.average(power / (1.0 + (corner / f) ** exponent), axis=1, weights=weight)
    return Noise(level, float(corner), float(exponent), source)


def _deviance(power: np.ndarray, weight: np.ndarray, shape: np.ndarray) -> float:
    """-2 log Whittle likelihood, white level of each channel at its best value."""
    level = np.average(power / shape, axis=1, weights=weight)
    return 2.0 * float(np.sum(weight) * np.sum(np.log(level)) + len(level) * np.sum(weight * np.log(shape)))


def _periodogram(channels: np.ndarray, slowest: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Periodogram in logarithmic bins: frequencies (k,), power (m, k), number of ordinates (k,)."""
    n = channels.shape[1]
    power = np.abs(rfft(channels, axis=1)[:, slowest : (n + 1) // 2]) ** 2 / n
    index = np.arange(slowest, slowest + power.shape[1])
    edges = np.unique(np.geomspace(slowest, index[-1] + 1, BINS).astype(int)) - slowest
    starts = edges[:-1]
    weight = np.diff(edges).astype(float)
    mean_f = np.exp(np.add.reduceat(np.log(index[: edges[-1]]), starts) / weight) / n
    return mean_f, np.add.reduceat(power[:, : edges[-1]], starts, axis=1) / weight, weight
