"""Models in which every sample sees the same matrix and the same constant: a fit needs only the log's moments.

    y = C z,   z = (1, B_x, B_y, B_z),   C (3, 4) a function of p                    (1)
    sum r r = sum r_0 r_0 - 2 D z r_0 + D z z D,   r_0 = y - C_0 z,   D = C - C_0    (2)

z z, z r_0 and r_0 r_0 summed over the log (by block, for the held-out error) give residual, gradient and Hessian at
any p without another pass. C_0 is a rough fit of a few samples, so that nothing large cancels in (2). C and its
derivatives come from the model itself, evaluated at four fields.
"""

from dataclasses import dataclass

import numpy as np

from barberpole.effects import Conditions
from barberpole.fit.gram import BLOCKS, Gram, Tick, block_edges, pieces
from barberpole.model import Model

SPAN_UT = 50.0  # between the four fields; any will do
FIELDS = np.hstack([np.zeros((3, 1)), SPAN_UT * np.eye(3)])
NEVER = 1e-9  # of the largest moment: a direction that the field never took
FEW = 200  # samples of the rough fit
CHUNK_SURFACE = 4096  # as long as the chunks of a problem
TOGETHER = 8  # neighbours that are added up to look at what is slow
CHUNK = 6000  # samples at a time: eight rows of them stay in the cache


@dataclass(frozen=True)
class Moments:
    """Of readings y (3, n) against fields b (3, n): `about` is C_0 (3, 4); by block zz (B, 4, 4), zr (B, 4, 3), rr
    (B, 3) and the number of residuals m (B,)."""

    y: np.ndarray
    b: np.ndarray
    about: np.ndarray
    zz: np.ndarray
    zr: np.ndarray
    rr: np.ndarray
    m: np.ndarray

    def best(self) -> np.ndarray:
        """C (3, 4) of least squares. Directions that the field never took are left out, for observability to name."""
        size, directions = np.linalg.eigh(self.zz.sum(axis=0))
        taken = directions[:, size > NEVER * size[-1]]
        inverse = (taken / size[size > NEVER * size[-1]]) @ taken.T
        return self.about + self.zr.sum(axis=0).T @ inverse

    def spans(self, part: float) -> bool:
        """Whether the field's smallest extent is at least `part` of its largest."""
        zz = self.zz.sum(axis=0)
        n, mean = zz[0, 0], zz[0, 1:] / zz[0, 0]
        extent = np.linalg.eigvalsh(zz[1:, 1:] / n - np.outer(mean, mean))
        return bool(n > 3 and extent[0] > part**2 * extent[2])

    def gram(self, value: np.ndarray, slopes: np.ndarray) -> Gram:
        """Normal equations at C = value (3, 4) with d C / d p = slopes (3, 4, P), by (2)."""
        apart, by_p = (value - self.about).T, slopes.reshape(12, -1)
        left = self.zr - self.zz @ apart  # z r, (B, 4, 3)
        jj = by_p.T @ (self.zz[:, None] @ slopes).reshape(BLOCKS, 12, -1)
        jr = left.transpose(0, 2, 1).reshape(BLOCKS, 12) @ by_p
        rr = np.sum(self.rr - np.sum((self.zr + left) * apart, axis=1), axis=1)
        return Gram(jj, jr, np.maximum(rr, 0.0), self.m)

    def squares(self, value: np.ndarray) -> np.ndarray:
        """Sum of the squared residuals of each channel (3,) at C = value (3, 4)."""
        apart, zr = (value - self.about).T, self.zr.sum(axis=0)
        left = zr - self.zz.sum(axis=0) @ apart
        return self.rr.sum(axis=0) - np.sum((zr + left) * apart, axis=0)


def moments(y: np.ndarray, b: np.ndarray) -> Moments:
    """One pass over readings (3, n) in LSB and fields (3, n) in µT."""
    n = y.shape[1]
    about = _rough(y[:, :: max(n // FEW, 1)], b[:, :: max(n // FEW, 1)])
    edges, rows = block_edges(n), np.ones((8, min(n, CHUNK)))  # z, r and a null, as products of eight rows are faster
    rows[7], sums = 0.0, np.zeros((BLOCKS, 8, 8))
    for at in range(0, n, CHUNK):
        chunk = slice(at, min(at + CHUNK, n))
        part = rows[:, : chunk.stop - at]
        part[1:4] = b[:, chunk]
        np.subtract(y[:, chunk], about @ part[:4], out=part[4:7])
        for block, of_chunk in pieces(edges, 0, chunk):
            piece = part[:, of_chunk]
            sums[block] += piece @ piece.T
    rr = sums.diagonal(axis1=1, axis2=2)[:, 4:7]
    return Moments(y, b, about, sums[:, :4, :4], sums[:, :4, 4:7], rr, 3.0 * np.diff(edges))


def neighbours(channels: np.ndarray) -> np.ndarray:
    """Channels (m, n) with TOGETHER neighbours added up, (m, n // TOGETHER): white where they are, and as slow."""
    whole = channels.shape[1] - channels.shape[1] % TOGETHER
    return channels[:, :whole].reshape(len(channels), -1, TOGETHER) @ np.ones(TOGETHER)


def _rough(y: np.ndarray, b: np.ndarray) -> np.ndarray:
    z = np.vstack([np.ones(y.shape[1]), b])
    zz = z @ z.T
    zz[np.diag_indices(4)] += 1e-9 * np.trace(zz)
    return np.linalg.solve(zz, z @ y.T).T


def is_affine(model: Model, at: Conditions) -> bool:
    """Whether (1) holds for this model under these conditions."""
    return all(t.effect.affine for t in model.terms) and not at.raw_polarity and np.ndim(at.gain) == 1


def coefficients(model: Model, p: np.ndarray, at: Conditions) -> tuple[np.ndarray, np.ndarray]:
    """C (3, 4) of (1) in LSB and LSB/µT, and d C / d p (3, 4, P)."""
    y, by_p, _ = model.linearise(FIELDS, p, Conditions(gain=at.gain))
    return _about_origin(y), _about_origin(by_p.transpose(0, 2, 1))


def constants(model: Model, p: np.ndarray, at: Conditions) -> np.ndarray:
    """C (3, 4) alone."""
    return _about_origin(model.predict(FIELDS, p, Conditions(gain=at.gain)))


def _about_origin(at_fields: np.ndarray) -> np.ndarray:
    out = (at_fields - at_fields[:, :1]) / SPAN_UT
    out[:, 0] = at_fields[:, 0]
    return out


def residual(problem, p: np.ndarray) -> np.ndarray:
    """All residuals (m, n) in LSB of a problem to which (1) applies, in one product."""
    value, seen = constants(problem.model, p, problem.seen.at), problem.seen
    if seen.b_ut is not None:
        return seen.y - (value[:, 1:] @ seen.b_ut + value[:, :1])
    inverse = np.linalg.inv(value[:, 1:])
    field = inverse @ seen.y
    field -= inverse @ value[:, :1]
    size = np.sqrt(np.einsum("ik,ik->k", field, field))
    steep = (inverse @ inverse.T) @ field
    steep = np.einsum("ik,ik->k", field, steep)
    return ((size - problem.magnitude(slice(None))) * size / np.sqrt(steep))[None]


def add_surface(gram: Gram, problem, p: np.ndarray, edges: np.ndarray, before: int, tick: Tick = None) -> None:
    """`gram.add_samples` for the distance of readings from the surface |B| = K: the derivatives of C are the same for
    all samples, so only n z (n the normal of the surface), the distance and what noise adds to it are summed."""
    value, slopes = coefficients(problem.model, p, problem.seen.at)
    rows, sums = np.empty((14, CHUNK_SURFACE)), np.zeros((BLOCKS, 14, 14))
    for chunk in problem.chunks():
        part = rows[:, : chunk.stop - chunk.start]
        _surface(problem.seen.y[:, chunk], problem.magnitude(chunk), value, part)
        if problem.believed is not None:
            part *= problem.believed[:, chunk]
        for block, of_chunk in pieces(edges, before, chunk):
            piece = part[:, of_chunk]
            sums[block] += piece @ piece.T
            gram.m[block] += problem.counted(slice(chunk.start + of_chunk.start, chunk.start + of_chunk.stop))
        if tick:
            tick(chunk.stop - chunk.start)
    by_p, longer = slopes.reshape(12, -1), gram.longer
    gram.jj[:] += by_p.T @ sums[:, :12, :12] @ by_p
    gram.jr[:] += sums[:, 12, :12] @ by_p
    gram.rr[:] += sums[:, 12, 12]
    if longer is not None:
        longer.jc[:] += sums[:, 13, :12] @ by_p
        longer.rc[:] += sums[:, 12, 13]
        longer.cc[:] += sums[:, 13, 13]


def _surface(reading: np.ndarray, magnitude, value: np.ndarray, out: np.ndarray) -> None:
    """n z (12), the distance in LSB and what noise of 1 LSB adds to it, for readings (3, k), into out (14, k).

    z is taken at the foot point on the surface, which noise along the normal does not reach.
    """
    inverse = np.linalg.inv(value[:, 1:])
    field = inverse @ (reading - value[:, :1])
    size = np.sqrt(np.einsum("ik,ik->k", field, field))
    gradient = inverse.T @ (field / size)
    steep2 = np.einsum("ik,ik->k", gradient, gradient)
    flat = 1.0 / np.sqrt(steep2)
    normal = gradient * flat
    np.multiply(size - magnitude, flat, out=out[12])
    field -= inverse @ (normal * out[12])
    by_z = out[:12].reshape(3, 4, -1)
    by_z[:, 0] = normal
    np.multiply(normal[:, None], field, out=by_z[:, 1:])
    np.multiply(np.sum(inverse * inverse) - steep2, flat / (2.0 * magnitude), out=out[13])
