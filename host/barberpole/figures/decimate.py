"""Fewer points for the eye; no fit sees these."""

from itertools import pairwise

import numpy as np

DRAWN = 1600  # points of one trace


def extremes(y: np.ndarray, most: int = DRAWN) -> np.ndarray:
    """Indices, rising, of the least and the greatest of y (n,) in each of most / 2 stretches: no peak is lost."""
    n = y.size
    if n <= most:
        return np.arange(n)
    starts = np.linspace(0, n, most // 2 + 1).astype(int)
    picked = [(a + int(np.argmin(y[a:b])), a + int(np.argmax(y[a:b]))) for a, b in pairwise(starts)]
    return np.unique(np.array(picked))


def scattered(y: np.ndarray, most: int = DRAWN) -> np.ndarray:
    """Indices, rising, of an even selection and of the largest magnitudes: a cloud, with its giants."""
    n = y.size
    if n <= most:
        return np.arange(n)
    few = most // 20
    giants = np.argpartition(np.abs(y), n - few)[n - few :]
    # a step that no period of the log divides: flips and rates are short whole numbers of rows
    even = (np.arange(most - few) * (n / (most - few))).astype(int)
    return np.union1d(even, giants)


def thin(values: np.ndarray) -> np.ndarray:
    """Single precision: enough for the eye, half the bytes in a page. Times stay as they are."""
    return np.asarray(values, dtype=np.float32)
