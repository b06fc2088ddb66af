"""The play operator: z follows x at a distance of at most r.

    z_0 = x_0,   z_k = min(max(z_(k-1), x_k - r), x_k + r)                           (1)

Each step is a clip, and two clips in a row are one clip again, so that n steps take log2(n) passes over the array.
"""

import numpy as np

from barberpole.effects.effect import Array


def contacts(x: Array, r: float) -> tuple[Array, Array]:
    """Where z last moved and which side pushed it, (n,) each, so that z = x[index] + side r."""
    low, high = x - r, x + r
    low[:1] = high[:1] = x[:1]
    z, shift = low.copy(), 1
    top = high.copy()
    while shift < x.size and np.any(z != top):
        lower = np.clip(z[:-shift], z[shift:], top[shift:])
        top[shift:] = np.clip(top[:-shift], z[shift:], top[shift:])
        z[shift:] = lower
        shift *= 2
    side = np.where(z == low, -1, np.where(z == high, 1, 0))
    side[:1] = 0
    index = np.where(side != 0, np.arange(x.size), 0)
    index = np.maximum.accumulate(index)
    return index, side[index]


def play(x: Array, r) -> Array:
    """z of (1) for x (n,); x and r may be complex, then the real parts decide what moves."""
    index, side = contacts(np.real(x), float(np.real(r)))
    return x[index] + side * r
