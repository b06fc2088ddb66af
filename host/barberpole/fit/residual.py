"""What is left of the readings once the model is taken off, in LSB, with its derivatives.

Vector reference: y - F(B, p), three residuals a sample. Scalar reference: only |B| = K is known, so the reading is
taken back through the model, and the residual is the distance of the reading from the surface |B| = K, measured in
reading space: one residual a sample, of the same noise as one reading whatever the gains of the axes.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from barberpole.chain import solve3
from barberpole.fit import affine
from barberpole.fit.affine import Moments, add_surface, coefficients, is_affine
from barberpole.fit.few import few
from barberpole.fit.gram import Gram, Tick, accumulate, add_samples
from barberpole.model import Model
from barberpole.observations import Observations

CHUNK = 4096  # samples at a time: the working set stays in the cache, and memory does not grow with the log
Linearised = tuple[np.ndarray, np.ndarray, np.ndarray | None]
NEAR = 0.01
MOST = 0.01  # of the cost: further away the normal equations say little
DIFFERENCE = 1e-6  # of a parameter's size: step of a numerical derivative


@dataclass(frozen=True)
class Problem:
    """A model held against observations. `magnitude_ut` is K where the log does not carry one (reference constant).

    believed (m, n): False where a residual is taken for an outlier and does not count. moments: of these readings
    against the known field, if they were taken.
    """

    model: Model
    seen: Observations
    magnitude_ut: float = 50.0
    believed: np.ndarray | None = None
    moments: Moments | None = None

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

    @property
    def affine(self) -> bool:
        """Whether every sample sees the same matrix and constant."""
        return is_affine(self.model, self.seen.at)

    def straight(self, rms: float) -> float:
        """Relative fall of the cost of a step after which another would be NEAR standard errors long; 0: not known.

        The surface |B| = K bends over its own size only. There a step of k standard errors e leaves k^2 e / size.
        """
        if self.vector or not self.affine:
            return 0.0
        return min(NEAR * self.extent / (3.0 * max(rms, 1e-300) * np.sqrt(self.n)), MOST)

    @cached_property
    def extent(self) -> float:
        """Half the range of the readings of the axis with the smallest, LSB."""
        return 0.5 * float(np.min(np.ptp(self.seen.y, axis=1)))

    @property
    def largest(self) -> float:
        """The largest reading in LSB."""
        return self._largest

    @cached_property
    def _largest(self) -> float:
        return max(float(np.max(self.seen.y, initial=0.0)), -float(np.min(self.seen.y, initial=0.0)))

    @cached_property
    def thinnest(self) -> float:
        """Standard deviation of the readings where their cloud is thinnest, LSB, of some of them."""
        y = self.seen.y[:, few(self.n)]
        y = y - y.mean(axis=1, keepdims=True)
        return float(np.sqrt(max(np.linalg.eigvalsh(y @ y.T / y.shape[1])[0], 0.0)))

    def gram(self, p: np.ndarray, sigma: float = 0.0, tick: Tick = None) -> Gram:
        """Normal equations at parameters p: one pass over the log, or none where its moments say it all.

        sigma (LSB): noise of a reading, which lengthens the fitted field of a scalar reference a little.
        """
        if self._known is None:
            return accumulate(self, p, sigma, tick)
        return self._known.gram(*coefficients(self.model, p, self.seen.at))

    @cached_property
    def _known(self) -> Moments | None:
        """The moments, where they say all that there is."""
        known = self.moments
        whole = known is not None and known.y is self.seen.y and self.believed is None and self.affine
        return known if whole else None

    def neighbours(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals with eight neighbours added up (m, n // 8), and the sums of their squares (m,); what does not count
        is null."""
        if self._known is None:
            residual = self.counting(p)
            return affine.neighbours(residual), np.einsum("mn,mn->m", residual, residual)
        value, seen = affine.constants(self.model, p, self.seen.at), self.seen
        summed = affine.neighbours(seen.y) - value[:, 1:] @ affine.neighbours(np.asarray(seen.b_ut))
        return summed - affine.TOGETHER * value[:, :1], self._known.squares(value)

    def counting(self, p: np.ndarray) -> np.ndarray:
        """All residuals (m, n) in LSB, null where they do not count."""
        return self.residual(p) if self.believed is None else self.residual(p) * self.believed

    def add_to(self, gram: Gram, p: np.ndarray, edges: np.ndarray, before: int, tick: Tick = None) -> None:
        """Add these samples at parameters p to sums over a log in which `before` samples came before them."""
        add = add_surface if self.affine and not self.vector else add_samples
        add(gram, self, p, edges, before, tick)

    def linearisation(self, p: np.ndarray) -> Callable[[slice], Linearised]:
        """A function of `rows` (k samples) for parameters p -> residual (m, k) and model derivative (m, P, k); m = 3
        vector, 1 scalar. Of a scalar reference also c (k,): noise of sigma (LSB) adds sigma^2 c to the residual.
        """
        if self.vector:
            one = partial(self._against_field, p)
        else:
            one = partial(self._with_memory if self.remembers else self._against_magnitude, p)
        return one if self.believed is None else lambda rows: self._masked(one(rows), rows)

    def _masked(self, found: Linearised, rows: slice) -> Linearised:
        """Without the residuals that are not believed."""
        (residual, d_p, longer), believed = found, np.asarray(self.believed)[:, rows]
        return residual * believed, d_p * believed[:, None], None if longer is None else longer * believed[0]

    def _against_field(self, p: np.ndarray, rows: slice) -> Linearised:
        seen = self.seen
        y, d_p, _ = self.model.linearise(np.asarray(seen.b_ut)[:, rows], p, seen.at.take(rows))
        return seen.y[:, rows] - y, d_p, None

    def _against_magnitude(self, p: np.ndarray, rows: slice) -> Linearised:
        residual, normal, longer, field, slope = self._distance(p, rows)
        # noise along the normal must not reach the derivatives: they are taken at the foot point on the surface
        foot = field - solve3(slope, normal * residual)
        d_p = self.model.linearise(foot, p, self.seen.at.take(rows))[1]
        return residual[None], (normal[0] * d_p[0] + normal[1] * d_p[1] + normal[2] * d_p[2])[None], longer

    def _distance(
        self, p: np.ndarray, rows: slice
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Distance (k,) of the readings from |B| = K in LSB, the unit normal there (3, k), what noise adds (k,), the
        fitted field (3, k) and d reading / d field (3, 3, k)."""
        at = self.seen.at.take(rows)
        field = self.model.invert(self.seen.y[:, rows], p, at)
        slope = self.model.slope(field, p, at)
        cofactor, det = cofactors(slope)
        norm = np.sqrt(np.sum(field * field, axis=0))
        gradient = np.sum(cofactor * (field / norm), axis=1) / det  # of |B| with respect to the reading
        steep = np.sqrt(np.sum(gradient * gradient, axis=0))
        known = self.magnitude(rows)
        # noise across the field lengthens it on average by its variance / 2K; unmodelled, more data do not help
        across = np.sum(cofactor * cofactor, axis=(0, 1)) / (det * det) - steep * steep
        return (norm - known) / steep, gradient / steep, across / (2.0 * known * steep), field, slope

    def normal(self, p: np.ndarray) -> np.ndarray:
        """(3, n) unit normals of the surface, in reading space: along them a scalar residual is measured."""
        return np.concatenate([self._distance(p, rows)[1] for rows in self.chunks()], axis=1)

    def _with_memory(self, p: np.ndarray, rows: slice) -> Linearised:
        """The same where the fitted field of a sample depends on earlier readings.

        Those effects' own derivatives are taken by one inversion each. The others' stand as if they had no memory:
        right to first order in it, which leaves the answer consistent.
        """
        base, normal, longer, field, _ = self._distance(p, rows)
        d_p = self.model.linearise(field, p, self.seen.at.take(rows))[1]
        derivative = normal[0] * d_p[0] + normal[1] * d_p[1] + normal[2] * d_p[2]
        for term in self.model.terms:
            for j in range(term.at.start, term.at.stop) if term.effect.tangent else ():
                step = np.zeros(len(p))
                step[j] = DIFFERENCE * max(abs(p[j]), abs(self.model.params[j].typical or 1.0))
                derivative[j] = (base - self._distance(p + step, rows)[0]) / step[j]
        return base[None], derivative[None], longer

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
        if self.affine:
            return affine.residual(self, p)
        return np.concatenate([self.residual_of(p, rows) for rows in self.chunks()], axis=1)

    def residual_of(self, p: np.ndarray, rows: slice) -> np.ndarray:
        """Those (m, k) of some samples."""
        seen = self.seen
        if seen.b_ut is None:
            return self._distance(p, rows)[0][None]
        return seen.y[:, rows] - self.model.predict(seen.b_ut[:, rows], p, seen.at.take(rows))


def cofactors(m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cofactors (3, 3, n) and determinants (n,) of m (3, 3, n): the inverse transposed is cofactors / determinant."""
    (a, b, c), (d, e, f), (g, h, i) = m
    rows = [
        [e * i - f * h, f * g - d * i, d * h - e * g],
        [c * h - b * i, a * i - c * g, b * g - a * h],
        [b * f - c * e, c * d - a * f, a * e - b * d],
    ]
    return np.array(rows), a * rows[0][0] + b * rows[0][1] + c * rows[0][2]
