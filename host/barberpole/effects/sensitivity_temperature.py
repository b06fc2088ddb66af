"""Sensitivity drift with temperature (thesis 3.22; fig. 6.18-6.19: cubic; article 3.1).

    y_i = x_i (1 + sum_k a_ik (T - T_0)^k)                                           (1)

The film's magnetoresistance and its anisotropy field fall with temperature, and so does the current of a bridge on a
constant voltage (3.19-3.22).
"""

import numpy as np

from barberpole.effects import polynomial
from barberpole.effects.effect import Conditions, Effect, Setup

TYPICAL_PER_K = 1e-3  # a third of the 0.3 %/K of bare permalloy, as constant-current bridges show (thesis fig. 3.10)


def params(setup: Setup):
    """a_ik in 1/K^k; order 1 unless the model file says otherwise."""
    return polynomial.params(setup, "1", "K", TYPICAL_PER_K, span=10.0)


def forward(xyz, p, at: Conditions):
    """Eq. (1), µT."""
    return tuple(v * (1.0 + g) for v, g in zip(xyz, polynomial.sums(p, at.temp_c - at.t0_c), strict=True))


def undo(xyz, p, at: Conditions):
    """Inverse of (1)."""
    return tuple(v / (1.0 + g) for v, g in zip(xyz, polynomial.sums(p, at.temp_c - at.t0_c), strict=True))


def jacobian(xyz, p, at: Conditions):
    """Slopes of (1)."""
    dt = np.atleast_1d(np.asarray(at.temp_c - at.t0_c, float))
    gain = np.stack([1.0 + g for g in polynomial.sums(p, dt)])
    return gain, polynomial.powers(p, dt) * np.tile(np.asarray(xyz), (len(p) // 3, 1))


SENSITIVITY_TEMPERATURE = Effect(
    "sensitivity_temperature",
    "y_i = x_i (1 + sum a_ik (T - T_0)^k)",
    "thesis 3.22, fig. 6.18-6.19; article 3.1",
    params,
    forward,
    undo,
    jacobian,
    requires=("temp_c",),
    summary="the sensitivity of each axis moves with temperature",
    shapes=lambda setup: polynomial.orders(1, 2),
    settings=("order",),
)
