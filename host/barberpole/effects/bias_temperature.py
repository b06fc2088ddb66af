"""Bias drift with temperature (thesis 3.25; fig. 6.17: quadratic; article 3.2).

    y_i = x_i + sum_k (b_ik + s o_ik) (T - T_0)^k                                    (1)

A bridge fed by a constant current has an offset in proportion to its resistance, hence to temperature (3.24-3.25). It
is constant in raw readings, so o exists only where both raw states are in the log and s alternates it (3.42);
flipping removes it (3.43), and what then remains, b, is the amplifier's.
"""

from dataclasses import replace

import numpy as np

from barberpole.effects import polynomial
from barberpole.effects.effect import Conditions, Effect, Setup

TYPICAL_UT_PER_K = 0.02  # article, table 1: 12 to 57 nT/K of the HMC5983 and LSM303DLHC
BRIDGE_UT_PER_K = 0.1  # 0.25 %/K of an offset of 40 µT


def params(setup: Setup):
    """b_ik and, for raw readings, o_ik in LSB/K^k; order 1 unless the model file says otherwise."""
    field_like = polynomial.params(setup, "LSB", "K", TYPICAL_UT_PER_K * setup.lsb_per_ut, span=10.0)
    if setup.flipping != "raw":
        return field_like
    bridge = polynomial.params(setup, "LSB", "K", BRIDGE_UT_PER_K * setup.lsb_per_ut, span=10.0)
    return field_like + tuple(replace(q, name=f"bridge_{q.name}") for q in bridge)


def drifts(p, at: Conditions):
    """The three drifts in LSB, for the state of each sample."""
    warmer = at.temp_c - at.t0_c
    if not at.raw_polarity:
        return polynomial.sums(p, warmer)
    half = len(p) // 2
    both = zip(polynomial.sums(p[:half], warmer), polynomial.sums(p[half:], warmer), strict=True)
    return [b + at.state * o for b, o in both]


def forward(xyz, p, at: Conditions):
    """Eq. (1), LSB."""
    return tuple(v + d for v, d in zip(xyz, drifts(p, at), strict=True))


def undo(xyz, p, at: Conditions):
    """Inverse of (1)."""
    return tuple(v - d for v, d in zip(xyz, drifts(p, at), strict=True))


def jacobian(xyz, p, at: Conditions):
    """Slopes of (1)."""
    warmer = at.temp_c - at.t0_c
    if not at.raw_polarity:
        return None, polynomial.powers(p, warmer)
    slopes = polynomial.powers(p[: len(p) // 2], warmer)
    return None, np.concatenate([slopes, at.state * slopes])


BIAS_TEMPERATURE = Effect(
    "bias_temperature",
    "y_i = x_i + sum (b_ik + s o_ik) (T - T_0)^k",
    "thesis 3.24-3.25, 3.42-3.43, fig. 6.17; article 3.2",
    params,
    forward,
    undo,
    jacobian,
    requires=("temp_c",),
    summary="the offset of each axis moves with temperature",
    shapes=lambda setup: polynomial.orders(1, 2),
    settings=("order",),
)
