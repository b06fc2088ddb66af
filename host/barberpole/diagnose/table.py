"""One Gram matrix of baseline, candidates and residual, by contiguous blocks: every score follows from it."""

from dataclasses import dataclass

import numpy as np

from barberpole.diagnose.whitening import Whitening
from barberpole.fit.gram import BLOCKS, FOLDS, block_edges

ALIKE = 1e-8  # squared sine of the angle between columns below which they are one
SEEN = 2.5e-3  # of a column's energy that must survive the baseline: 5 % of its RMS


class Design:
    """Columns of the residual channels; a column that is zero in a channel takes no room there."""

    def __init__(self, channels: int):
        self.rows: list[list[np.ndarray]] = [[] for _ in range(channels)]
        self.index: list[list[np.ndarray]] = [[] for _ in range(channels)]
        self.count = 0

    def add(self, columns: np.ndarray) -> np.ndarray:
        """Columns (m, K, n) -> their numbers (K,)."""
        for channel, block in enumerate(columns):
            filled = np.flatnonzero(np.any(block, axis=1))
            if filled.size:
                self.rows[channel].append(block[filled])
                self.index[channel].append(filled + self.count)
        numbers = np.arange(self.count, self.count + columns.shape[1])
        self.count += columns.shape[1]
        return numbers

    def add_to(self, channel: int, rows: np.ndarray) -> np.ndarray:
        """Rows (K, n) that act on one channel only -> their numbers (K,)."""
        numbers = np.arange(self.count, self.count + len(rows))
        self.rows[channel].append(rows)
        self.index[channel].append(numbers)
        self.count += len(rows)
        return numbers

    def combine(self, weights: np.ndarray) -> np.ndarray:
        """Sum of columns times weights (count,), (m, n)."""
        return np.stack(
            [
                sum((weights[i] @ r for i, r in zip(index, rows, strict=True)), np.zeros(1))
                for index, rows in zip(self.index, self.rows, strict=True)
            ]
        )

    def kept(self) -> np.ndarray:
        """(m, n // 2 + 1): part of white noise that a fit by all columns but the last leaves at each frequency."""
        return np.stack(
            [
                _kept(np.concatenate(rows)[np.concatenate(index) < self.count - 1])
                for rows, index in zip(self.rows, self.index, strict=True)
            ]
        )


def _kept(columns: np.ndarray) -> np.ndarray:
    n = columns.shape[1]
    columns = columns / np.maximum(np.linalg.norm(columns, axis=1), 1e-300)[:, None]
    values, vectors = np.linalg.eigh(columns @ columns.T)
    used = values > ALIKE
    basis = (vectors[:, used] / np.sqrt(values[used])).T @ columns
    return 1.0 - np.sum(np.abs(np.fft.rfft(basis, axis=1)) ** 2, axis=0) / n


@dataclass(frozen=True)
class Table:
    """Per block: Gram (B, C, C) of all columns in noise units, the last being the residual; residuals m (B,)."""

    gram: np.ndarray
    m: np.ndarray

    @property
    def total(self) -> np.ndarray:
        return self.gram.sum(axis=0)

    @property
    def count(self) -> float:
        return float(self.m.sum())


def tabulate(design: Design, white: Whitening) -> Table:
    """Whiten every column and accumulate. The residual must have been added last."""
    gram = np.zeros((BLOCKS, design.count, design.count))
    m = np.zeros(BLOCKS)
    for channel, (rows, index) in enumerate(zip(design.rows, design.index, strict=True)):
        if not rows:
            continue
        whitened, numbers = white.apply(channel, np.concatenate(rows)), np.concatenate(index)
        edges = block_edges(whitened.shape[1])
        for block in range(BLOCKS):
            part = whitened[:, edges[block] : edges[block + 1]]
            gram[block][np.ix_(numbers, numbers)] += part @ part.T
            m[block] += part.shape[1]
    return Table(gram, m)


@dataclass(frozen=True)
class Projection:
    """All columns with the baseline taken off: matrix (C, C), energy before it (C,), number of residuals left."""

    matrix: np.ndarray
    energy: np.ndarray
    freedom: float

    @property
    def rss(self) -> float:
        return float(self.matrix[-1, -1])

    def score(self, columns: np.ndarray) -> tuple[float, int]:
        """Fall of the residual sum of squares by these columns, and how many directions of them can be seen."""
        weights, rank = self.weights(columns)
        return float(weights @ self.matrix[columns, -1]), rank

    def weights(self, columns: np.ndarray) -> tuple[np.ndarray, int]:
        """Least-squares weights, in the directions that survive the baseline."""
        size = np.sqrt(np.maximum(self.energy[columns], 1e-300))
        values, vectors = np.linalg.eigh(self.matrix[np.ix_(columns, columns)] / np.outer(size, size))
        kept = values > SEEN
        inverse = np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0)
        return vectors @ (inverse * (vectors.T @ (self.matrix[columns, -1] / size))) / size, int(kept.sum())

    def visibility(self, columns: np.ndarray) -> float:
        """RMS that survives the baseline over RMS before."""
        before = float(np.sum(self.energy[columns]))
        after = float(np.sum(np.diag(self.matrix)[columns]))
        return float(np.sqrt(max(after, 0.0) / before)) if before > 0 else 0.0


def project(table: Table, baseline: np.ndarray) -> Projection:
    """Take the baseline columns off all others."""
    g = table.total
    energy = np.diag(g).copy()
    size = np.sqrt(np.maximum(energy[baseline], 1e-300))
    values, vectors = np.linalg.eigh(g[np.ix_(baseline, baseline)] / np.outer(size, size))
    kept = values > 1e-12 * max(values[-1], 1e-300)
    basis = (vectors[:, kept] / np.sqrt(values[kept])) / size[:, None]
    cross = basis.T @ g[baseline]
    matrix = g - cross.T @ cross
    return Projection(matrix, energy, table.count - float(kept.sum()))


def heldout(table: Table, columns: np.ndarray) -> np.ndarray:
    """Sum of squares of each fold's residual under the least-squares fit to the other folds, (FOLDS,)."""
    total, out = table.total, np.empty(FOLDS)
    size = np.sqrt(np.maximum(np.diag(total)[columns], 1e-300))
    for fold in range(FOLDS):
        part = table.gram[[fold, fold + FOLDS]].sum(axis=0)
        rest = total - part
        h = rest[np.ix_(columns, columns)] / np.outer(size, size)
        weights = np.linalg.pinv(h, rcond=1e-8, hermitian=True) @ (rest[columns, -1] / size) / size
        out[fold] = part[-1, -1] - 2 * weights @ part[columns, -1] + weights @ part[np.ix_(columns, columns)] @ weights
    return out
