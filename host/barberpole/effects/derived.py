"""What a user's effect gets without writing it: derivatives and inverse, from `forward` alone.

Derivatives by the complex step, exact to rounding, where `forward` takes complex numbers; else by central differences,
good to about 1e-9 of their size. The inverse by Newton's method, or, where a sample depends on earlier ones, by adding
the gap until none is left, which settles while the effect is a small change of the field.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from barberpole.chain import solve3
from barberpole.effects.effect import Array, Conditions

COMPLEX_STEP = 1e-30
DIFFERENCE = 6e-6  # cube root of the rounding: where its error meets that of the second derivative
UNDO_STEPS = 50
UNDONE = 1e-13

Forward = Callable[[Any, Any, Conditions], Any]
Directional = Callable[[Callable[[Any], Any], Array, float], Array]


def by_complex_step(along: Callable[[Any], Any], shape: Array, size: float) -> Array:
    """d along(s) / ds at s = 0, for a function of a complex number s; result broadcast to the shape of `shape`."""
    step = COMPLEX_STEP * size
    return np.imag(np.broadcast_to(np.asarray(along(1j * step)), shape.shape)) / step


def by_differences(along: Callable[[Any], Any], shape: Array, size: float) -> Array:
    """The same from two real evaluations; `size` is how far s may go for a change worth the name."""
    step = DIFFERENCE * size
    change = np.asarray(along(step)) - np.asarray(along(-step))
    return np.broadcast_to(change, shape.shape) / (2.0 * step)


def slopes(forward: Forward, sizes: Array, memory: bool, derive: Directional):
    """A `jacobian` for the effect. sizes (K,): typical parameters."""

    def jacobian(xyz, p, at: Conditions):
        x, numbers = np.asarray(xyz), np.asarray(p, float)
        span = max(float(np.max(np.abs(x), initial=0.0)), 1e-9)
        d_p = [
            derive(lambda s, j=j: forward(xyz, numbers + s * (np.arange(len(numbers)) == j), at), x, abs(size))
            for j, size in enumerate(sizes)
        ]
        columns = np.stack(d_p, axis=1) if d_p else np.zeros((3, 0, x.shape[1]))
        if memory:
            return None, columns
        d_in = [derive(lambda s, j=j: forward(x + s * np.eye(3)[:, j, None], p, at), x, span) for j in range(3)]
        return np.stack(d_in, axis=1), columns

    return jacobian


def carrier(forward: Forward, derive: Directional):
    """A `tangent` for an effect with memory: one evaluation or two for each derivative carried."""

    def tangent(xyz, p, at: Conditions, chain):
        x, out = np.asarray(xyz), np.zeros_like(chain, float)
        span = max(float(np.max(np.abs(x), initial=0.0)), 1e-9)
        for k in range(out.shape[1]):
            largest = float(np.max(np.abs(chain[:, k]), initial=0.0))
            size = span / largest if largest else 1.0
            out[:, k] = derive(lambda s, k=k: forward(x + s * chain[:, k], p, at), x, size)
        return out

    return tangent


def inverse(forward: Forward, jacobian, memory: bool):
    """An `undo` for arrays, by iteration; NaN where it does not settle."""

    def undo(xyz, p, at: Conditions):
        y = np.asarray(xyz, float)
        x, gap = y.copy(), y
        for _ in range(UNDO_STEPS):
            gap = y - np.asarray(forward(x, p, at))
            x = x + (gap if memory else solve3(jacobian(x, p, at)[0], gap))
            if not np.nanmax(np.abs(gap), initial=0.0) > UNDONE * np.nanmax(np.abs(y), initial=0.0):
                return tuple(x)
        return tuple(np.where(np.abs(gap) < 1e-6 * np.max(np.abs(y), initial=0.0), x, np.nan))

    return undo
