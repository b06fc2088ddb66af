"""One Gram matrix of baseline, candidates, covariates and residual, by contiguous blocks: all scores follow from it."""

from dataclasses import dataclass

import numpy as np

from barberpole.diagnose.whitening import Whitening
from barberpole.fit.gram import BLOCKS, FOLDS, block_edges
from barberpole.fit.noise import Noise

ALIKE = 1e-8  # squared sine of the angle between columns below which they are one
SEEN = 2.5e-3  # of a column's energy that must survive the baseline: 5 % of its RMS
CHUNK = 4096  # samples multiplied at a time, so that they stay in the cache
LONG = 20_000  # samples; above, the few frequencies a fit can empty are simply left out
EMPTIED = 64  # of them

Parts = list[tuple[np.ndarray, np.ndarray]]
"""Columns by channel: which of them are not zero there (k,), and those (k, n)."""


def parts_of(columns: np.ndarray) -> Parts:
    """Dense columns (m, K, n) as parts."""
    filled = [np.flatnonzero(np.any(block, axis=1)) for block in columns]
    return [(index, block[index]) for index, block in zip(filled, columns, strict=True)]


class Design:
    """Columns of the residual channels; a column that is zero in a channel takes no room there."""

    def __init__(self, channels: int):
        self.parts: list[Parts] = [[] for _ in range(channels)]
        self.count = 0

    def add(self, parts: Parts, count: int) -> np.ndarray:
        """`count` columns -> their numbers (count,)."""
        for channel, (index, rows) in enumerate(parts):
            if index.size:
                self.parts[channel].append((index + self.count, rows))
        return self._numbered(count)

    def add_to(self, channel: int, rows: np.ndarray) -> np.ndarray:
        """Rows (K, n) that act on one channel only -> their numbers (K,)."""
        self.parts[channel].append((np.arange(self.count, self.count + len(rows)), rows))
        return self._numbered(len(rows))

    def _numbered(self, count: int) -> np.ndarray:
        self.count += count
        return np.arange(self.count - count, self.count)

    def combine(self, weights: np.ndarray) -> np.ndarray:
        """Sum of columns times weights (count,), (m, n)."""
        return np.stack([sum((weights[i] @ r for i, r in parts), np.zeros(1)) for parts in self.parts])

    def kept(self, products: "Products") -> np.ndarray:
        """(m, n // 2 + 1): part of white noise that a fit by all columns but the last leaves at each frequency.

        In a long log the fit takes a few low frequencies and next to nothing of the rest.
        """
        n = self.parts[0][0][1].shape[1]
        if n > LONG:
            out = np.ones((len(self.parts), n // 2 + 1))
            out[:, :EMPTIED] = 0.0
            return out
        out = []
        for parts, (numbers, gram) in zip(self.parts, products.channels, strict=True):
            taken = numbers != self.count - 1  # the last is not there where a channel has no residual at all
            columns = np.concatenate([rows for _, rows in parts])[taken]
            out.append(_kept(columns, gram.sum(axis=0)[np.ix_(taken, taken)]))
        return np.stack(out)


def _kept(columns: np.ndarray, total: np.ndarray) -> np.ndarray:
    size = np.sqrt(np.maximum(np.diag(total), 1e-300))
    values, vectors = np.linalg.eigh(total / np.outer(size, size))
    used = values > ALIKE
    basis = (vectors[:, used] / np.sqrt(values[used]) / size[:, None]).T @ columns
    return 1.0 - np.sum(np.abs(np.fft.rfft(basis, axis=1)) ** 2, axis=0) / columns.shape[1]


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


@dataclass(frozen=True)
class Products:
    """Per channel: numbers of its columns (k,), Gram by blocks (B, k, k) in whatever units the columns have."""

    channels: list[tuple[np.ndarray, np.ndarray]]
    m: np.ndarray
    count: int

    def table(self, noise: Noise | None = None) -> Table:
        """All channels together, each over its white level."""
        gram = np.zeros((BLOCKS, self.count, self.count))
        for channel, (numbers, part) in enumerate(self.channels):
            level = 1.0 if noise is None else noise.white[channel]
            gram[:, numbers[:, None], numbers] += part / level
        return Table(gram, self.m * len(self.channels))


def multiply(design: Design) -> Products:
    """The Gram matrices of the columns as they are."""
    n = design.parts[0][0][1].shape[1]
    edges = block_edges(n)
    channels = []
    for parts in design.parts:
        numbers = np.concatenate([index for index, _ in parts])
        gram = np.zeros((BLOCKS, numbers.size, numbers.size))
        for block in range(BLOCKS):
            for at in range(edges[block], edges[block + 1], CHUNK):
                part = np.concatenate([rows[:, at : min(at + CHUNK, edges[block + 1])] for _, rows in parts])
                gram[block] += part @ part.T
        channels.append((numbers, gram))
    return Products(channels, np.diff(edges).astype(float), design.count)


def tabulate(design: Design, white: Whitening, products: Products | None = None) -> Table:
    """Gram of the whitened columns; of white noise from `products` where they are known."""
    if not white.filter:
        return (products or multiply(design)).table(white.noise)
    whitened = Design(len(design.parts))
    whitened.count = design.count
    for channel, parts in enumerate(design.parts):
        rows = white.apply(channel, np.concatenate([r for _, r in parts]))
        whitened.parts[channel].append((np.concatenate([i for i, _ in parts]), rows))
    return multiply(whitened).table()


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
        if len(columns) == 1:
            own = self.matrix[columns[0], columns[0]]
            seen = own > SEEN * self.energy[columns[0]] and own > 0
            return (float(self.matrix[columns[0], -1] ** 2 / own), 1) if seen else (0.0, 0)
        weights, rank = self.weights(columns)
        return float(weights @ self.matrix[columns, -1]), rank

    def weights(self, columns: np.ndarray) -> tuple[np.ndarray, int]:
        """Least-squares weights, in the directions that survive the baseline."""
        inverse, rank = self.inverse(columns)
        return inverse @ self.matrix[columns, -1], rank

    def inverse(self, columns: np.ndarray) -> tuple[np.ndarray, int]:
        """Pseudo-inverse of their Gram matrix, and its rank."""
        size = np.sqrt(np.maximum(self.energy[columns], 1e-300))
        values, vectors = np.linalg.eigh(self.matrix[np.ix_(columns, columns)] / np.outer(size, size))
        kept = values > SEEN
        inverse = np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0)
        scaled = vectors / size[:, None]
        return (scaled * inverse) @ scaled.T, int(kept.sum())

    def likeness(self, signal: np.ndarray, columns: np.ndarray) -> float:
        """Correlation of what the columns `signal` take of the residual with what `columns` can take of that."""
        weights = self.weights(signal)[0]
        energy = float(weights @ self.matrix[np.ix_(signal, signal)] @ weights)
        target = self.matrix[columns][:, signal] @ weights
        return float(np.sqrt(max(target @ self.inverse(columns)[0] @ target, 0.0) / energy)) if energy > 0 else 0.0

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
    kept = values > 1e-12 * np.max(values, initial=1e-300)
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
