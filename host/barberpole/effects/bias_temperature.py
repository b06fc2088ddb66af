"""Bias drift with temperature (thesis 3.25; fig. 6.17: quadratic; article 3.2).

    y_i = x_i + sum_k b_ik dT^k                                                      (1)
"""

import numpy as np

from barberpole.effects import temperature
from barberpole.effects.effect import Conditions, Effect, Setup


def params(setup: Setup):
    """b_ik in LSB/K^k; order 1 unless the model file says otherwise."""
    return temperature.params(setup, "LSB", 0.01 * setup.lsb_per_ut, temperature.order_of(setup, 1))


def forward(xyz, p, at: Conditions):
    """Eq. (1), LSB."""
    return tuple(v + d for v, d in zip(xyz, temperature.polynomial(p, at), strict=True))


def undo(xyz, p, at: Conditions):
    """Inverse of (1)."""
    return tuple(v - d for v, d in zip(xyz, temperature.polynomial(p, at), strict=True))


def jacobian(xyz, p, at: Conditions):
    """Derivatives of (1)."""
    return None, temperature.powers(p, at, np.shape(xyz)[1])


BIAS_TEMPERATURE = Effect(
    "bias_temperature",
    "y_i = x_i + sum b_ik dT^k",
    "thesis 3.25, fig. 6.17; article 3.2",
    params,
    forward,
    undo,
    jacobian,
    requires=("temp_c",),
)
