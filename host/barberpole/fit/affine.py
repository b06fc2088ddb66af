"""Models in which every sample sees the same matrix and the same constant: a fit needs only the log's moments.

    y = C z,   z = (1, B_x, B_y, B_z),   C (3, 4) a function of p                    (1)
    sum r r = sum r_0 r_0 - 2 D z r_0 + D z z D,   r_0 = y - C_0 z,   D = C - C_0    (2)

z z, z r_0 and r_0 r_0 summed over the log (by block, for the held-out error) give residual, gradient and Hessian at
any p without another pass. C_0 is a rough fit of a few samples, so that nothing large cancels in (2). C and its
derivatives come from the model itself, evaluated at four fields.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from barberpole.effects import Conditions
from barberpole.fit.gram import BLOCKS, Gram, Tick, block_edges, pieces
from barberpole.model import Model

SPAN_UT = 50.0  # between the four fields; any will do
FIELDS = np.hstack([np.zeros((3, 1)), SPAN_UT * np.eye(3)])
FEW = 200  # samples of the rough fit
CHUNK_SURFACE = 4096  # as long as the chunks of a problem
CHUNK = 16384  # samples at a time: seven rows of them stay in the cache


@dataclass(frozen=True)
class Moments:
    """Of readings y (3, n) against fields b (3, n): `about` is C_0 (3, 4); by block zz (B, 4, 4), zr (B, 4, 3), rr (B,)
    and the number of residuals m (B,)."""

    y: np.ndarray
    b: np.ndarray
    about: np.ndarray
    zz: np.ndarray
    zr: np.ndarray
    rr: np.ndarray
    m: np.ndarray

    def best(self) -> np.ndarray:
        """C (3, 4) of least squares. Directions that the field never took are left out, for observability to name."""
        return self.about + self.zr.sum(axis=0).T @ np.linalg.pinv(self.zz.sum(axis=0), rcond=1e-9, hermitian=True)

    def gram(self, value: np.ndarray, slopes: np.ndarray) -> Gram:
        """Normal equations at C = value (3, 4) with d C / d p = slopes (3, 4, P), by (2)."""
        apart, zz = (value - self.about).T, self.zz[:, None]
        left = self.zr - self.zz @ apart  # z r, (B, 4, 3)
        jj = np.sum(slopes.transpose(0, 2, 1) @ (zz @ slopes), axis=1)
        jr = left.transpose(0, 2, 1).reshape(BLOCKS, 12) @ slopes.reshape(12, -1)
        rr = self.rr - np.sum((self.zr + left) * apart, axis=(1, 2))
        return Gram(jj, jr, np.maximum(rr, 0.0), self.m)


def moments(y: np.ndarray, b: np.ndarray) -> Moments:
    """One pass over readings (3, n) in LSB and fields (3, n) in µT."""
    n = y.shape[1]
    about = _rough(y[:, :: max(n // FEW, 1)], b[:, :: max(n // FEW, 1)])
    edges, rows = block_edges(n), np.ones((7, min(n, CHUNK)))  # z and r
    sums = np.zeros((BLOCKS, 7, 7))
    for block, (first, last) in enumerate(pairwise(edges.tolist())):
        for at in range(first, last, CHUNK):
            stop = min(at + CHUNK, last)
            part = rows[:, : stop - at]
            part[1:4] = b[:, at:stop]
            np.subtract(y[:, at:stop], about @ part[:4], out=part[4:])
            sums[block] += part @ part.T
    rr = np.trace(sums[:, 4:, 4:], axis1=1, axis2=2)
    return Moments(y, b, about, sums[:, :4, :4], sums[:, :4, 4:], rr, 3.0 * np.diff(edges))


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


def _about_origin(at_fields: np.ndarray) -> np.ndarray:
    out = (at_fields - at_fields[:, :1]) / SPAN_UT
    out[:, 0] = at_fields[:, 0]
    return out


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
