"""The chain rule over stages, pulled back from the reading: each parameter's column is multiplied once.

A slope is d out / d in of one stage or of several: (3, n) where diagonal, else (3, 3, n); the last dimension may be 1
where all samples agree. n samples, K parameters.
"""

import numpy as np

from barberpole.effects.effect import spread

Array = np.ndarray
UNIT = np.ones((3, 1))


def through(tail: Array, d_in: Array | None) -> Array:
    """d reading / d in of a stage from d reading / d out of it."""
    if d_in is None:
        return tail
    if d_in.ndim == 2:
        return tail * d_in
    if tail.ndim == 2:
        return tail[:, None] * d_in
    return tail[:, 0, None] * d_in[0] + tail[:, 1, None] * d_in[1] + tail[:, 2, None] * d_in[2]


def add_columns(out: Array, tail: Array, d_p: Array) -> None:
    """out (3, K, n) += tail d_p, with d_p (3, K, n), or (K, n) where parameter j acts on axis j % 3 alone."""
    for axis in range(3):
        if d_p.ndim == 2 and tail.ndim == 2:
            out[axis, axis::3] += tail[axis] * d_p[axis::3]
        elif d_p.ndim == 2:
            out[:, axis::3] += tail[:, axis, None] * d_p[axis::3]
        elif tail.ndim == 2:
            out[axis] += tail[axis] * d_p[axis]
        else:
            out += tail[:, axis, None] * d_p[axis]


def sum_slopes(one: Array | None, other: Array) -> Array:
    """Sum of two slopes of any form; None is nothing yet."""
    if one is None:
        return other
    if one.ndim == other.ndim:
        return one + other
    return (one if one.ndim == 3 else spread(one)) + (other if other.ndim == 3 else spread(other))


def full(slope: Array, n: int) -> Array:
    """Any slope as (3, 3, n)."""
    return np.broadcast_to(slope if slope.ndim == 3 else spread(slope), (3, 3, n))


def solve3(matrix: Array, right: Array) -> Array:
    """x of matrix x = right for n systems at once: (3, 3, n), (3, n) -> (3, n), by Cramer's rule."""
    (a, b, c), (d, e, f), (g, h, i) = matrix
    u, v, w = right
    ei_fh, fg_di, dh_eg = e * i - f * h, f * g - d * i, d * h - e * g
    x = u * ei_fh + v * (c * h - b * i) + w * (b * f - c * e)
    y = u * fg_di + v * (a * i - c * g) + w * (c * d - a * f)
    z = u * dh_eg + v * (b * g - a * h) + w * (a * e - b * d)
    return np.stack([x, y, z]) / (a * ei_fh + b * fg_di + c * dh_eg)
