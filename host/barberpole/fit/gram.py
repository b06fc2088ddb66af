"""Normal equations by contiguous blocks of the log: one pass gives the step, the covariance and the held-out error."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg.lapack import dposv  # pyright: ignore[reportAttributeAccessIssue] (made when scipy is loaded)

BLOCKS = 10  # contiguous, so that a held-out stretch is really unseen; folds leave out two of them at a time
FOLDS = 5

Tick = Callable[[int], None] | None
"""Told how many samples more are done."""


@dataclass(frozen=True)
class Lengthening:
    """What noise does to a scalar residual, r = r_0 - sigma^2 c: sums per block of J^T c (B, P), r_0 c and c c (B,)."""

    jc: np.ndarray
    rc: np.ndarray
    cc: np.ndarray


@dataclass(frozen=True)
class Gram:
    """Per block: J^T J (B, P, P), J^T r (B, P), r^T r (B,), residuals m (B,). r is that of noise `sigma`."""

    jj: np.ndarray
    jr: np.ndarray
    rr: np.ndarray
    m: np.ndarray
    longer: Lengthening | None = None
    sigma: float = 0.0

    @property
    def cost(self) -> float:
        return float(self.rr.sum())

    @property
    def count(self) -> int:
        return int(self.m.sum())

    def take(self, columns: np.ndarray) -> "Gram":
        """The same for some of the parameters, at the noise that it has."""
        return Gram(self.jj[:, columns][:, :, columns], self.jr[:, columns], self.rr, self.m)

    def rms(self) -> float:
        """Root mean square residual."""
        return float(np.sqrt(self.cost / max(self.count, 1)))

    def at_noise(self, sigma: float) -> "Gram":
        """The same for another noise in LSB: no second pass."""
        if self.longer is None or sigma == self.sigma:
            return self
        more, c = sigma**2 - self.sigma**2, self.longer
        jr, rr = self.jr - more * c.jc, self.rr - 2.0 * more * c.rc + more**2 * c.cc
        return replace(self, jr=jr, rr=np.maximum(rr, 0.0), longer=replace(c, rc=c.rc - more * c.cc), sigma=sigma)

    def moved(self, step: np.ndarray) -> "Gram":
        """The same after a small step (P,) of the parameters, by the derivatives that it holds: no second pass."""
        h = self.jj @ step
        rr = self.rr - 2.0 * (self.jr @ step) + h @ step
        longer = self.longer and replace(self.longer, rc=self.longer.rc - self.longer.jc @ step)
        return replace(self, jr=self.jr - h, rr=np.maximum(rr, 0.0), longer=longer)


def block_edges(n: int) -> np.ndarray:
    """Where the contiguous blocks of n samples begin and end."""
    return np.linspace(0, n, BLOCKS + 1).astype(int)


def empty(size: int, scalar: bool) -> Gram:
    """Nothing yet, for `size` parameters."""
    sums = (np.zeros((BLOCKS, size, size)), np.zeros((BLOCKS, size)), np.zeros(BLOCKS), np.zeros(BLOCKS))
    return Gram(*sums, Lengthening(np.zeros((BLOCKS, size)), np.zeros(BLOCKS), np.zeros(BLOCKS)) if scalar else None)


def accumulate(problem, p: np.ndarray, sigma: float = 0.0, tick: Tick = None) -> Gram:
    """One pass over the log at parameters p. `tick` is told the samples done."""
    gram = empty(len(p), not problem.vector)
    problem.add_to(gram, p, block_edges(problem.n), 0, tick)
    return gram.at_noise(sigma)


def add_samples(gram: Gram, problem, p: np.ndarray, edges: np.ndarray, before: int, tick: Tick = None) -> None:
    """Add the samples of a problem to sums without noise. Of the whole log, `before` samples came before them; `edges`
    are those of its blocks."""
    linearise = problem.linearisation(p)
    for rows in problem.chunks():
        r, j, longer = linearise(rows)
        for block, part in pieces(edges, before, rows):
            _add(gram, block, r[:, part], j[:, :, part])
            gram.m[block] += problem.counted(slice(rows.start + part.start, rows.start + part.stop))
            if gram.longer is not None and longer is not None:
                _add_longer(gram.longer, block, r[0, part], j[0, :, part], longer[part])
        if tick:
            tick(rows.stop - rows.start)


def pieces(edges: np.ndarray, before: int, rows: slice) -> Iterator[tuple[int, slice]]:
    """The blocks that a chunk of samples reaches into, and which samples of the chunk are theirs."""
    first, last = rows.start + before, rows.stop + before
    for block in range(int(np.searchsorted(edges, first, "right")) - 1, int(np.searchsorted(edges, last))):
        yield block, slice(max(int(edges[block]), first) - first, min(int(edges[block + 1]), last) - first)


def _add(gram: Gram, block: int, r: np.ndarray, j: np.ndarray) -> None:
    for residual, columns in zip(r, j, strict=True):
        gram.jj[block] += columns @ columns.T
        gram.jr[block] += columns @ residual
        gram.rr[block] += residual @ residual


def _add_longer(longer: Lengthening, block: int, r: np.ndarray, j: np.ndarray, c: np.ndarray) -> None:
    longer.jc[block] += j @ c
    longer.rc[block] += r @ c
    longer.cc[block] += c @ c


def heldout_rms(gram: Gram) -> float:
    """RMS residual of each fold under the parameters fitted to the others, all together."""
    return float(np.sqrt(sum(square for square, _ in by_fold(gram)) / gram.count))


def by_fold(gram: Gram) -> Iterator[tuple[float, float]]:
    """Sum of the squared residuals of each fold under the parameters fitted to the others, and how many they are.

    At the optimum the fit without some blocks differs by one Gauss-Newton step, (H - H_b)^-1 g_b, and its residuals
    follow from the same normal equations: no refit. Infinite where the rest does not determine the parameters.
    """
    total = gram.jj.sum(axis=0)
    for fold in range(FOLDS):
        out = [fold, fold + FOLDS]
        h, g = gram.jj[out].sum(axis=0), gram.jr[out].sum(axis=0)
        try:
            shift = solve_scaled(total - h, -g)
        except np.linalg.LinAlgError:
            yield float("inf"), float(gram.m[out].sum())
            continue
        left = gram.rr[out].sum() - 2.0 * shift @ g + shift @ h @ shift
        yield max(float(left), 0.0), float(gram.m[out].sum())


def solve_scaled(h: np.ndarray, g: np.ndarray, damping: float = 0.0) -> np.ndarray:
    """x of (H + damping diag H) x = g with the columns brought to unit size first. Raises LinAlgError if singular."""
    size = np.sqrt(np.diag(h))
    size = np.where(size > 0, size, 1.0)
    scaled = h / (size[:, None] * size)
    scaled.flat[:: size.size + 1] += damping
    _, x, not_positive = dposv(scaled, g / size)
    if not_positive:
        raise np.linalg.LinAlgError("the columns do not determine the parameters")
    return x / size
