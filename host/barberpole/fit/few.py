"""Some samples for all of them, where a median or a spread need not be exact."""

from functools import lru_cache

import numpy as np

ENOUGH = 1000  # the median of so many is right within 4 %
GOLDEN = 0.6180339887498949


@lru_cache(maxsize=8)
def few(n: int) -> np.ndarray | slice:
    """Index of at most ENOUGH of n samples, in order, one of each stretch, where no period of the log meets them."""
    if n <= ENOUGH:
        return slice(None)
    stretch = np.arange(ENOUGH)
    return ((stretch + stretch * GOLDEN % 1.0) * (n / ENOUGH)).astype(int)
