"""Bias drift with temperature (thesis 3.25; fig. 6.17: quadratic; article 3.2).

    y_i = x_i + sum_k b_ik (T - T_0)^k                                               (1)

A bridge fed by a constant current has an offset in proportion to its resistance, hence to temperature (3.24);
flipping removes most of it (3.43), and what remains is the amplifier's.
"""

from barberpole.effects import polynomial
from barberpole.effects.effect import Conditions, Effect, Setup

TYPICAL_UT_PER_K = 0.02  # article, table 1: 12 to 57 nT/K of the HMC5983 and LSM303DLHC


def params(setup: Setup):
    """b_ik in LSB/K^k; order 1 unless the model file says otherwise."""
    return polynomial.params(setup, "LSB", "K", TYPICAL_UT_PER_K * setup.lsb_per_ut, span=10.0)


def forward(xyz, p, at: Conditions):
    """Eq. (1), LSB."""
    return tuple(v + d for v, d in zip(xyz, polynomial.sums(p, at.temp_c - at.t0_c), strict=True))


def undo(xyz, p, at: Conditions):
    """Inverse of (1)."""
    return tuple(v - d for v, d in zip(xyz, polynomial.sums(p, at.temp_c - at.t0_c), strict=True))


def jacobian(xyz, p, at: Conditions):
    """Slopes of (1)."""
    return None, polynomial.powers(p, at.temp_c - at.t0_c)


BIAS_TEMPERATURE = Effect(
    "bias_temperature",
    "y_i = x_i + sum b_ik (T - T_0)^k",
    "thesis 3.25, fig. 6.17; article 3.2",
    params,
    forward,
    undo,
    jacobian,
    requires=("temp_c",),
    summary="the offset of each axis moves with temperature",
    shapes=lambda setup: polynomial.orders(1, 2),
)
