"""Polynomials in temperature or time, shared by `bias_temperature`, `sensitivity_temperature` and `drift`.

    P(u) = c_1 u + c_2 u^2 + ...                                                     (1)

u = T - T_0 in K or t - t_0 in s, from the reference of the calibration; the constant belongs to `bias` and `scale`.
The order is a setting of each effect. Parameters: x_1, y_1, z_1, x_2, ...
"""

import numpy as np

from barberpole.effects.effect import Array, Param, Setup, Shape
from barberpole.errors import InputError, must

MAX_ORDER = 5


def params(setup: Setup, unit: str, per: str, typical: float, span: float) -> tuple[Param, ...]:
    """Three coefficients an order; each order is taken to matter half as much as the one before over the span."""
    found = []
    for k in range(1, order_of(setup) + 1):
        each = f"{unit}/{per}" if k == 1 else f"{unit}/{per}^{k}"
        found += [Param(f"{axis}_{k}", each, typical=typical * (0.5 / span) ** (k - 1)) for axis in "xyz"]
    return tuple(found)


def order_of(setup: Setup) -> int:
    """The order asked for in the model file, 1 unless it says otherwise. Raises InputError for what is none."""
    order = setup.settings.get("order", 1)
    if not isinstance(order, int) or not 1 <= order <= MAX_ORDER:
        raise InputError(must("setting order", f"a whole number from 1 to {MAX_ORDER}", repr(order)))
    return order


def orders(*wanted: int) -> tuple[Shape, ...]:
    """One form for each order."""
    return tuple(Shape(settings={"order": order}) for order in wanted)


def sums(p, u):
    """(1) for the three axes, by Horner."""
    out = []
    for axis in range(3):
        total = 0.0
        for coefficient in reversed(p[axis::3]):
            total = (total + coefficient) * u
        out.append(total)
    return out


def powers(p, u) -> Array:
    """(len(p), n): derivative of (1) by each coefficient, which acts on axis j % 3."""
    u = np.atleast_1d(np.asarray(u, float))
    return np.repeat(np.cumprod(np.broadcast_to(u, (-(-len(p) // 3), u.size)), axis=0), 3, axis=0)[: len(p)]
