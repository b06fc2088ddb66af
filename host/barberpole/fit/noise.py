"""The sensor's own noise: white plus a power law.

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
COLOURED = 16.0  # gain in -2 log likelihood that a corner must bring
NEGLIGIBLE = 1e-4  # weight of a law in a mean
LEAST_KEPT = 0.05  # of the power of a bin: less says nothing


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

    def at_rate(self, ratio: float, level: float = 1.0) -> "Noise":
        """The same sensor sampled `ratio` times as often, each sample with `level` times the white power.

        The power law keeps its density in LSB^2/Hz; what the white part becomes hangs on what was averaged.
        """
        corner = self.corner * (ratio ** (1.0 - self.exponent) / level) ** (1.0 / self.exponent)
        return replace(self, corner=corner, white=self.white * level)

    def common(self) -> "Noise":
        """The same for one channel: the mean of the axes."""
        return replace(self, white=np.array([float(np.mean(self.white))]))


def power_law(f: np.ndarray, corner: float, exponent: float) -> np.ndarray:
    """1 + (corner / f)^exponent."""
    return 1.0 + (corner / f) ** exponent if corner > 0 else np.ones_like(f)


def frequencies(n: int) -> np.ndarray:
    """Those of rfft, in cycles a sample; half a cycle a record stands for the mean."""
    f = np.arange(n // 2 + 1) / n
    f[0] = 0.5 / n
    return f


def estimate(
    channels: np.ndarray, source: str, kept: np.ndarray | None = None, normal: np.ndarray | None = None
) -> Noise:
    """Noise of channels (m, n).

    kept (m, n // 2 + 1): part of the power that a fit has left at each frequency. normal (3, n): of a scalar residual,
    along which the noise of the three axes was taken while the sensor turned.
    """
    found = _trials(channels, kept, normal)
    best = int(np.argmin(found.deviance))
    if found.deviance[0] - found.deviance[best] < COLOURED:
        best = 0
    return Noise(found.levels[best], *(float(v) for v in found.laws[best]), source=source)


def expected(
    channels: np.ndarray, f: np.ndarray, kept: np.ndarray | None = None, normal: np.ndarray | None = None
) -> np.ndarray | None:
    """Spectrum (m, k) at frequencies f (k,) > 0: the mean of all power laws, each as likely as it makes these channels.

    None where they are white. A short record hardly tells the exponent; the mean holds the steep ones too.
    """
    found = _trials(channels, kept, normal)
    if found.deviance[0] - found.deviance.min() < COLOURED:
        return None
    weight = np.exp(-0.5 * (found.deviance - found.deviance.min()))
    weight /= weight.sum()
    terms = [
        w * level[:, None] * power_law(f, *law)
        for w, level, law in zip(weight, found.levels, found.laws, strict=True)
        if w > NEGLIGIBLE
    ]
    return np.sum(terms, axis=0)


@dataclass(frozen=True)
class _Trials:
    """Corner and exponent of each law tried, white first; deviance (k,) and white level (k, m) of each."""

    laws: list[tuple[float, float]]
    deviance: np.ndarray
    levels: np.ndarray


def _trials(channels: np.ndarray, kept: np.ndarray | None, normal: np.ndarray | None) -> _Trials:
    n = channels.shape[1]
    bins, f = _edges(n), frequencies(n)
    power = np.abs(rfft(channels - channels.mean(axis=1, keepdims=True), axis=1)) ** 2 / n
    kept = np.ones(power.shape) if kept is None else kept
    part = _binned(kept, bins)
    binned, weight = _binned(power, bins) / np.maximum(part, LEAST_KEPT), np.diff(bins) * np.maximum(part, 1e-9)
    turning = None if normal is None else _turning(normal)
    laws = [(0.0, 1.0)] + [(c, a) for c in CORNERS[1.0 / n < CORNERS] for a in EXPONENTS]
    shapes = [_binned(_seen_turning(power_law(f, c, a), turning, n)[None], bins)[0] for c, a in laws]
    deviance = np.array([_deviance(binned, weight, shape) for shape in shapes])
    levels = np.array([np.sum(binned / shape * weight, axis=1) / weight.sum(axis=1) for shape in shapes])
    return _Trials(laws, deviance, levels)


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
    """-2 log Whittle likelihood of (m, k) bins, the white level of each channel at its best value."""
    total = weight.sum(axis=1)
    level = np.sum(power / shape * weight, axis=1) / total
    return 2.0 * float(np.sum(total * np.log(level)) + np.sum(weight * np.log(shape)))


def _edges(n: int) -> np.ndarray:
    """Logarithmic bins of the ordinates of a periodogram, without the mean."""
    return np.unique(np.geomspace(1, (n + 1) // 2, BINS).astype(int))


def _binned(power: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Mean of (m, k) ordinates in bins."""
    return np.add.reduceat(power[:, : edges[-1]], edges[:-1], axis=1) / np.diff(edges)
