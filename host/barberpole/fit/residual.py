"""What is left of the readings once the model is taken off, in LSB, with its derivatives.

Vector reference: y - F(B, p), three residuals a sample. Scalar reference: only |B| = K is known, so the reading is
taken back through the model, and the residual is the distance of the reading from the surface |B| = K, measured in
reading space: one residual a sample, of the same noise as one reading whatever the gains of the axes.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from barberpole.chain import solve3
from barberpole.model import Model
from barberpole.observations import Observations

CHUNK = 4096  # samples at a time: the working set stays in the cache, and memory does not grow with the log


@dataclass(frozen=True)
class Problem:
    """A model held against observations. `magnitude_ut` is K where the log does not carry one (reference constant)."""

    model: Model
    seen: Observations
    magnitude_ut: float = 50.0

    @property
    def vector(self) -> bool:
        return self.seen.reference == "vector"

    @property
    def n(self) -> int:
        return self.seen.y.shape[1]

    @property
    def residuals_per_sample(self) -> int:
        return 3 if self.vector else 1

    def chunks(self, start: int = 0, stop: int | None = None) -> Iterator[slice]:
        """Slices of samples that cover [start, stop)."""
        stop = self.n if stop is None else stop
        for at in range(start, stop, CHUNK):
            yield slice(at, min(at + CHUNK, stop))

    def linearise(self, p: np.ndarray, rows: slice, sigma: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Residual (m, k) and model derivative (m, P, k) for the k samples of `rows`; m = 3 vector, 1 scalar."""
        seen, at = self.seen, self.seen.at.take(rows)
        if seen.b_ut is not None:
            y, d_p, _ = self.model.linearise(seen.b_ut[:, rows], p, at)
            return seen.y[:, rows] - y, d_p
        return self._scalar(p, rows, at, sigma)

    def _scalar(self, p, rows, at, sigma):
        field = self.model.invert(self.seen.y[:, rows], p, at)
        _, d_p, slope = self.model.linearise(field, p, at, field_too=True)
        norm = np.sqrt(np.sum(field * field, axis=0))
        normal = solve3(slope.transpose(1, 0, 2), field / norm)  # gradient of |B| with respect to the reading
        steep = np.sqrt(np.sum(normal * normal, axis=0))
        known = self.magnitude(rows)
        expected = known + self._noise_lengthens(slope, steep, known, sigma)
        return ((norm - expected) / steep)[None], np.einsum("in,ipn->pn", normal / steep, d_p)[None]

    def magnitude(self, rows: slice) -> np.ndarray | float:
        """K of each sample in µT."""
        return self.magnitude_ut if self.seen.b_mag is None else self.seen.b_mag[rows]

    @staticmethod
    def _noise_lengthens(slope, steep, known, sigma):
        """Noise across the field lengthens it on average by its variance / 2K; unmodelled, more data do not help."""
        if sigma == 0.0:
            return 0.0
        total = sum(
            np.sum(solve3(slope, np.broadcast_to(e[:, None], steep.shape[:0] + (3, steep.size))) ** 2, axis=0)
            for e in np.eye(3)
        )
        return sigma * sigma * (total - steep * steep) / (2.0 * known)

    def residual(self, p: np.ndarray) -> np.ndarray:
        """All residuals (m, n) in LSB."""
        seen = self.seen
        if seen.b_ut is None:
            return np.concatenate([self.linearise(p, rows)[0] for rows in self.chunks()], axis=1)
        parts = [seen.y[:, r] - self.model.predict(seen.b_ut[:, r], p, seen.at.take(r)) for r in self.chunks()]
        return np.concatenate(parts, axis=1)
