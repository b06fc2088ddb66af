"""Whitening a scalar residual in coloured noise: the noise lives on the axes, and turning modulates it.

    r_t = sum_i u_i(t) s_i(t) + white,   s_i = sum_k x_ik,   x_ik(t+1) = a_k x_ik(t) + drive       (1)

u is the unit normal of |B| = K in reading space. The power law of each axis is built from a few first-order processes
(non-negative least squares on its spectrum); a Kalman filter then turns r into its innovations, which are white.
The log is cut into segments filtered side by side, each with a run-in before its start.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import nnls

from barberpole.diagnose.noise import Noise, power_law

SPACING = 6.0  # between the corner frequencies of the processes
SEGMENT = 4096  # samples
RUN_IN = 1024  # samples that a segment's filter is given to settle


@dataclass(frozen=True)
class TurningNoise:
    """A `Noise` of the axes as a scalar residual sees it. gain (B, T, S) and spread (B, T) of the filter."""

    axes: Noise
    decay: np.ndarray
    normal: np.ndarray
    gain: np.ndarray = field(repr=False)
    spread: np.ndarray = field(repr=False)

    @property
    def white(self) -> np.ndarray:
        return self.axes.white

    @property
    def coloured(self) -> bool:
        return True

    @property
    def source(self) -> str:
        return self.axes.source

    def shape(self, f: np.ndarray) -> np.ndarray:
        """Of the axes."""
        return self.axes.shape(f)

    def rms(self, n: int) -> float:
        """RMS in LSB."""
        return self.axes.rms(n)

    def whiten(self, channel: int, rows: np.ndarray) -> np.ndarray:
        """Innovations of rows (K, n) over their standard deviation."""
        pieces = _segments(rows)  # (B, T, K)
        state = np.zeros((pieces.shape[0], len(self.decay), rows.shape[0]))
        normal = _loadings(_segments(self.normal), len(self.decay))
        out = np.empty_like(pieces)
        for t in range(pieces.shape[1]):
            state *= self.decay[:, None]
            surprise = pieces[:, t] - np.matmul(normal[:, t, None], state)[:, 0]
            state += self.gain[:, t, :, None] * surprise[:, None]
            out[:, t] = surprise
        return _joined(out / self.spread[:, :, None], rows.shape[1])


def turning_noise(axes: Noise, normal: np.ndarray) -> TurningNoise:
    """The filter for a noise of the axes and a normal (3, n)."""
    axes = axes.common()
    decay, variance = _processes(axes, normal.shape[1])
    decay, variance = np.tile(decay, 3), np.tile(variance, 3)
    gain, spread = _filter(_loadings(_segments(normal), len(decay)), decay, variance, float(axes.white[0]))
    return TurningNoise(axes, decay, normal, gain, spread)


def _processes(axes: Noise, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Decay a sample and stationary variance of first-order processes that add up to the coloured part."""
    corners = np.geomspace(0.25 / n, 0.3, max(int(np.log(1.2 * n) / np.log(SPACING)) + 2, 2))
    decay = np.exp(-2 * np.pi * corners)
    f = np.geomspace(0.5 / n, 0.5, 200)
    target = power_law(f, axes.corner, axes.exponent) - 1.0
    basis = (1 - decay**2) / (1 - 2 * decay * np.cos(2 * np.pi * f[:, None]) + decay**2)
    weights, _ = nnls(basis / target[:, None], np.ones(f.size))
    kept = weights > 0
    return decay[kept], float(axes.white[0]) * weights[kept]


def _filter(normal, decay, variance, white) -> tuple[np.ndarray, np.ndarray]:
    """Kalman gains (B, T, S) and standard deviations of the innovations (B, T); they do not depend on the data."""
    segments, length, size = normal.shape
    cov = np.tile(np.diag(variance), (segments, 1, 1))
    fade, drive = np.outer(decay, decay), np.diag(variance * (1 - decay**2))
    gain, spread = np.empty(normal.shape), np.empty((segments, length))
    for t in range(length):
        cov = cov * fade + drive
        h = normal[:, t, :, None]
        along = np.matmul(cov, h)
        s = np.matmul(h.transpose(0, 2, 1), along) + white
        gain[:, t] = (along / s)[:, :, 0]
        spread[:, t] = np.sqrt(s[:, 0, 0])
        cov = cov - along * along.transpose(0, 2, 1) / s
    return gain, spread


def _loadings(normal: np.ndarray, size: int) -> np.ndarray:
    """Normal (B, T, 3) repeated for the processes of each axis, (B, T, S)."""
    return np.repeat(normal, size // 3, axis=2)


def _segments(rows: np.ndarray) -> np.ndarray:
    """Rows (K, n) cut into segments with their run-in, (B, T, K); zeros before the log and after its end."""
    n = rows.shape[1]
    count = -(-n // SEGMENT)
    run_in = RUN_IN if count > 1 else 0
    length = min(n, SEGMENT)
    padded = np.pad(rows, ((0, 0), (run_in, count * length - n)))
    return np.stack([padded[:, b * length : (b + 1) * length + run_in].T for b in range(count)])


def _joined(pieces: np.ndarray, n: int) -> np.ndarray:
    """The segments without their run-in, (K, n)."""
    length = min(n, SEGMENT)
    kept = pieces[:, pieces.shape[1] - length :]
    return kept.reshape(-1, kept.shape[2])[:n].T


AnyNoise = Noise | TurningNoise
