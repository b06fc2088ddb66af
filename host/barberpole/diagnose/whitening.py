"""Making residuals white: a Kalman filter turns coloured noise into its innovations.

    r_t = sum_i u_i(t) s_i(t) + white,   s_i = sum_k x_ik,   x_ik(t+1) = a_k x_ik(t) + drive       (1)

A vector residual has u = 1 on its own axis. A scalar one has the unit normal of |B| = K in reading space: the noise
lives on the axes, and turning modulates it. The power law of an axis is built from a few first-order processes, by
non-negative least squares on its spectrum. Whitening by Fourier transform would take the log for periodic, and see
in the slow swing of 1/f noise a jump from its end to its start. Long logs are cut into segments filtered side by side,
each with a run-in before its start.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import nnls

from barberpole.fit.noise import Noise, power_law

SPACING = 6.0  # between the corner frequencies of the processes
SEGMENT = 4096  # samples
RUN_IN = 1024  # samples that a segment's filter is given to settle


@dataclass(frozen=True)
class Whitening:
    """A `Noise` as residual channels see it. Of the filter, for unit white level: decay (S,) of the states, loading
    (B, T, S), gain (B, T, S), spread (B, T); none of them for white noise."""

    noise: Noise
    filter: tuple[np.ndarray, ...] = field(default=(), repr=False)

    def apply(self, channel: int, rows: np.ndarray) -> np.ndarray:
        """Rows (K, n) of one channel with unit variance and no correlation."""
        scaled = rows / np.sqrt(self.noise.white[channel])
        return _innovations(scaled, *self.filter) if self.filter else scaled


def whitening(noise: Noise, n: int, normal: np.ndarray | None = None) -> Whitening:
    """The filter for vector residuals of n samples or, with a normal (3, n), for a scalar one."""
    noise = noise if normal is None else noise.common()
    if not noise.coloured:
        return Whitening(noise)
    decay, variance = _processes(noise, n)
    axes = np.ones((1, n)) if normal is None else normal
    loading = np.repeat(_segments(axes), len(decay), axis=2)
    decay, variance = np.tile(decay, len(axes)), np.tile(variance, len(axes))
    gain, spread = _gains(loading, decay, variance)
    return Whitening(noise, (decay, loading, gain, spread))


def _processes(noise: Noise, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Decay a sample and stationary variance, over the white level, of processes that add up to the coloured part."""
    corners = np.geomspace(0.25 / n, 0.3, max(int(np.log(1.2 * n) / np.log(SPACING)) + 2, 2))
    decay = np.exp(-2 * np.pi * corners)
    f = np.geomspace(0.5 / n, 0.5, 200)
    target = power_law(f, noise.corner, noise.exponent) - 1.0
    basis = (1 - decay**2) / (1 - 2 * decay * np.cos(2 * np.pi * f[:, None]) + decay**2)
    weights, _ = nnls(basis / target[:, None], np.ones(f.size))
    return decay[weights > 0], weights[weights > 0]


def _gains(loading, decay, variance) -> tuple[np.ndarray, np.ndarray]:
    """Kalman gains (B, T, S) and standard deviations of the innovations (B, T); they do not depend on the data."""
    segments, length, _ = loading.shape
    cov = np.tile(np.diag(variance), (segments, 1, 1))
    fade, drive = np.outer(decay, decay), np.diag(variance * (1 - decay**2))
    gain, spread = np.empty(loading.shape), np.empty((segments, length))
    for t in range(length):
        cov = cov * fade + drive
        h = loading[:, t, :, None]
        along = np.matmul(cov, h)
        s = np.matmul(h.transpose(0, 2, 1), along) + 1.0
        gain[:, t] = (along / s)[:, :, 0]
        spread[:, t] = np.sqrt(s[:, 0, 0])
        cov = cov - along * along.transpose(0, 2, 1) / s
    return gain, spread


def _innovations(rows: np.ndarray, decay, loading, gain, spread) -> np.ndarray:
    """Rows (K, n) less what the filter expects, over the standard deviation of that."""
    pieces = _segments(rows)  # (B, T, K)
    state = np.zeros((pieces.shape[0], len(decay), rows.shape[0]))
    out = np.empty_like(pieces)
    for t in range(pieces.shape[1]):
        state *= decay[:, None]
        out[:, t] = pieces[:, t] - np.matmul(loading[:, t, None], state)[:, 0]
        state += gain[:, t, :, None] * out[:, t, None]
    return _joined(out / spread[:, :, None], rows.shape[1])


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
