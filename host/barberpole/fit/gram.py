"""Normal equations by contiguous blocks of the log: one pass gives the step, the covariance and the held-out error."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

BLOCKS = 10  # contiguous, so that a held-out stretch is really unseen; folds leave out two of them at a time
FOLDS = 5


@dataclass(frozen=True)
class Gram:
    """Per block: J^T J (B, P, P), J^T r (B, P), r^T r (B,), residuals m (B,)."""

    jj: np.ndarray
    jr: np.ndarray
    rr: np.ndarray
    m: np.ndarray

    @property
    def cost(self) -> float:
        return float(self.rr.sum())

    @property
    def count(self) -> int:
        return int(self.m.sum())

    def take(self, columns: np.ndarray) -> "Gram":
        """The same for some of the parameters."""
        return Gram(self.jj[:, columns][:, :, columns], self.jr[:, columns], self.rr, self.m)

    def rms(self) -> float:
        """Root mean square residual."""
        return float(np.sqrt(self.cost / max(self.count, 1)))


def block_edges(n: int) -> np.ndarray:
    """Where the contiguous blocks of n samples begin and end."""
    return np.linspace(0, n, BLOCKS + 1).astype(int)


def accumulate(problem, p: np.ndarray, sigma: float = 0.0, tick: Callable[[int], None] | None = None) -> Gram:
    """One pass over the log at parameters p. `tick` is told the samples done."""
    size, edges = len(p), block_edges(problem.n)
    gram = Gram(np.zeros((BLOCKS, size, size)), np.zeros((BLOCKS, size)), np.zeros(BLOCKS), np.zeros(BLOCKS))
    for rows in problem.chunks():
        r, j = problem.linearise(p, rows, sigma)
        for block in range(BLOCKS):
            first, last = max(edges[block], rows.start) - rows.start, min(edges[block + 1], rows.stop) - rows.start
            if first < last:
                _add(gram, block, r[:, first:last], j[:, :, first:last])
                gram.m[block] += problem.counted(slice(rows.start + first, rows.start + last))
        if tick:
            tick(rows.stop - rows.start)
    return gram


def _add(gram: Gram, block: int, r: np.ndarray, j: np.ndarray) -> None:
    for residual, columns in zip(r, j, strict=True):
        gram.jj[block] += columns @ columns.T
        gram.jr[block] += columns @ residual
        gram.rr[block] += residual @ residual


def heldout_rms(gram: Gram) -> float:
    """RMS residual of each block under the parameters fitted without it.

    At the optimum the fit without block b differs by one Gauss-Newton step, (H - H_b)^-1 g_b, and its residuals follow
    from the same normal equations: no refit. Infinite where the rest does not determine the parameters.
    """
    total, left = gram.jj.sum(axis=0), 0.0
    for fold in range(FOLDS):
        out = [fold, fold + FOLDS]
        h, g = gram.jj[out].sum(axis=0), gram.jr[out].sum(axis=0)
        try:
            shift = solve_scaled(total - h, -g)
        except np.linalg.LinAlgError:
            return float("inf")
        left += gram.rr[out].sum() - 2.0 * shift @ g + shift @ h @ shift
    return float(np.sqrt(max(left, 0.0) / gram.count))


def solve_scaled(h: np.ndarray, g: np.ndarray, damping: float = 0.0) -> np.ndarray:
    """x of (H + damping diag H) x = g with the columns brought to unit size first. Raises LinAlgError if singular."""
    size = np.sqrt(np.diag(h))
    size = np.where(size > 0, size, 1.0)
    scaled = h / np.outer(size, size)
    scaled[np.diag_indices_from(scaled)] += damping
    factor = np.linalg.cholesky(scaled)
    return np.linalg.solve(factor.T, np.linalg.solve(factor, g / size)) / size
