"""What is left of the readings once the model is taken off, in LSB, with its derivatives.

Vector reference: y - F(B, p), three residuals a sample. Scalar reference: only |B| = K is known, so the reading is
taken back through the model, and the residual is the distance of the reading from the surface |B| = K, measured in
reading space: one residual a sample, of the same noise as one reading whatever the gains of the axes.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from barberpole.model import Model
from barberpole.observations import Observations

CHUNK = 4096  # samples at a time: the working set stays in the cache, and memory does not grow with the log
DIFFERENCE = 1e-6  # of a parameter's size: step of a numerical derivative


@dataclass(frozen=True)
class Problem:
    """A model held against observations. `magnitude_ut` is K where the log does not carry one (reference constant).

    believed (m, n): False where a residual is taken for an outlier and does not count.
    """

    model: Model
    seen: Observations
    magnitude_ut: float = 50.0
    believed: np.ndarray | None = None

    @property
    def vector(self) -> bool:
        return self.seen.reference == "vector"

    @property
    def n(self) -> int:
        return self.seen.y.shape[1]

    @property
    def residuals_per_sample(self) -> int:
        return 3 if self.vector else 1

    @cached_property
    def remembers(self) -> bool:
        """Whether a reading depends on the field of earlier samples."""
        return any(term.effect.tangent for term in self.model.terms)

    def chunks(self) -> Iterator[slice]:
        """Slices of samples that cover the log; one where an effect needs the whole series."""
        size = self.n if self.model.memory else CHUNK
        for at in range(0, self.n, size):
            yield slice(at, min(at + size, self.n))

    def linearise(self, p: np.ndarray, rows: slice, sigma: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Residual (m, k) and model derivative (m, P, k) for the k samples of `rows`; m = 3 vector, 1 scalar.

        sigma (LSB): noise of a reading, which lengthens the fitted field of a scalar reference a little.
        """
        residual, d_p = self._linearise(p, rows, sigma)
        if self.believed is None:
            return residual, d_p
        believed = self.believed[:, rows]
        return residual * believed, d_p * believed[:, None]

    def _linearise(self, p: np.ndarray, rows: slice, sigma: float) -> tuple[np.ndarray, np.ndarray]:
        seen, at = self.seen, self.seen.at.take(rows)
        if seen.b_ut is not None:
            y, d_p, _ = self.model.linearise(seen.b_ut[:, rows], p, at)
            return seen.y[:, rows] - y, d_p
        if self.remembers:
            return self._with_memory(p, rows, sigma)
        residual, normal, d_p = self._distance(p, rows, sigma)
        return residual[None], (normal[0] * d_p[0] + normal[1] * d_p[1] + normal[2] * d_p[2])[None]

    def _distance(self, p: np.ndarray, rows: slice, sigma: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distance (k,) of the readings from |B| = K in LSB, the unit normal there (3, k), d reading / d p."""
        at = self.seen.at.take(rows)
        field = self.model.invert(self.seen.y[:, rows], p, at)
        _, d_p, slope = self.model.linearise(field, p, at, field_too=True)
        cofactor, det = cofactors(np.asarray(slope))
        norm = np.sqrt(np.sum(field * field, axis=0))
        gradient = np.sum(cofactor * (field / norm), axis=1) / det  # of |B| with respect to the reading
        steep = np.sqrt(np.sum(gradient * gradient, axis=0))
        known = self.magnitude(rows)
        # noise across the field lengthens it on average by its variance / 2K; unmodelled, more data do not help
        across = np.sum(cofactor * cofactor, axis=(0, 1)) / (det * det) - steep * steep
        return (norm - known - sigma * sigma * across / (2.0 * known)) / steep, gradient / steep, d_p

    def _with_memory(self, p: np.ndarray, rows: slice, sigma: float) -> tuple[np.ndarray, np.ndarray]:
        """The same where the fitted field of a sample depends on earlier readings.

        Those effects' own derivatives are taken by one inversion each. The others' stand as if they had no memory:
        right to first order in it, which leaves the answer consistent.
        """
        base, normal, d_p = self._distance(p, rows, sigma)
        derivative = normal[0] * d_p[0] + normal[1] * d_p[1] + normal[2] * d_p[2]
        for term in self.model.terms:
            for j in range(term.at.start, term.at.stop) if term.effect.tangent else ():
                step = np.zeros(len(p))
                step[j] = DIFFERENCE * max(abs(p[j]), abs(self.model.params[j].typical or 1.0))
                derivative[j] = (base - self._distance(p + step, rows, sigma)[0]) / step[j]
        return base[None], derivative[None]

    def counted(self, rows: slice) -> int:
        """How many residuals of `rows` count."""
        if self.believed is None:
            return (rows.stop - rows.start) * self.residuals_per_sample
        return int(np.count_nonzero(self.believed[:, rows]))

    def magnitude(self, rows: slice) -> np.ndarray | float:
        """K of each sample in µT."""
        return self.magnitude_ut if self.seen.b_mag is None else self.seen.b_mag[rows]

    def residual(self, p: np.ndarray) -> np.ndarray:
        """All residuals (m, n) in LSB, outliers too."""
        seen = self.seen
        if seen.b_ut is None:
            return np.concatenate([self._distance(p, rows, 0.0)[0] for rows in self.chunks()])[None]
        field = seen.b_ut
        parts = [seen.y[:, r] - self.model.predict(field[:, r], p, seen.at.take(r)) for r in self.chunks()]
        return np.concatenate(parts, axis=1)


def cofactors(m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cofactors (3, 3, n) and determinants (n,) of m (3, 3, n): the inverse transposed is cofactors / determinant."""
    (a, b, c), (d, e, f), (g, h, i) = m
    rows = [
        [e * i - f * h, f * g - d * i, d * h - e * g],
        [c * h - b * i, a * i - c * g, b * g - a * h],
        [b * f - c * e, c * d - a * f, a * e - b * d],
    ]
    return np.array(rows), a * rows[0][0] + b * rows[0][1] + c * rows[0][2]
