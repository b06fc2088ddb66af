"""Polynomials in temperature, shared by `bias_temperature` and `sensitivity_temperature`.

    P(T) = c_1 dT + c_2 dT^2 + ...,   dT = T - T_0                                   (1)

T_0 is the reference temperature of the calibration; the constant belongs to `bias` and `scale`. The order is a
setting of each effect. Parameters: x_1, y_1, z_1, x_2, ... in 1/K^order.
"""

import numpy as np

from barberpole.effects.effect import Conditions, Param, Setup


def params(setup: Setup, unit: str, typical_per_k: float, order: int) -> tuple[Param, ...]:
    """Three coefficients an order; each order is expected to matter a tenth as much over 10 K."""
    return tuple(
        Param(f"{axis}_{k}", f"{unit}/K^{k}" if k > 1 else f"{unit}/K", typical=typical_per_k * 10.0 ** (2 - 2 * k))
        for k in range(1, order + 1)
        for axis in "xyz"
    )


def order_of(setup: Setup, default: int) -> int:
    """The polynomial order asked for in the model file."""
    return int(setup.settings.get("order", default))


def polynomial(p, at: Conditions):
    """(1) for the three axes, by Horner."""
    dt = at.temp_c - at.t0_c
    sums = []
    for axis in range(3):
        total = 0.0
        for coefficient in reversed(p[axis::3]):
            total = (total + coefficient) * dt
        sums.append(total)
    return sums


def powers(p, at: Conditions, n: int):
    """(3, len(p), n): derivative of (1) with respect to each coefficient."""
    dt = np.broadcast_to(np.asarray(at.temp_c, float) - at.t0_c, (n,))
    out = np.zeros((3, len(p), n))
    for j in range(len(p)):
        out[j % 3, j] = dt ** (j // 3 + 1)
    return out
