"""Sensitivity drift with temperature (thesis 3.22; fig. 6.18-6.19: cubic; article 3.1).

    y_i = x_i (1 + sum_k a_ik dT^k)                                                  (1)
"""

import numpy as np

from barberpole.effects import temperature
from barberpole.effects.effect import Conditions, Effect, Setup


def params(setup: Setup):
    """a_ik in 1/K^k; order 1 unless the model file says otherwise."""
    return temperature.params(setup, "1", 1e-3, temperature.order_of(setup, 1))


def forward(xyz, p, at: Conditions):
    """Eq. (1), µT."""
    return tuple(v * (1.0 + g) for v, g in zip(xyz, temperature.polynomial(p, at), strict=True))


def undo(xyz, p, at: Conditions):
    """Inverse of (1)."""
    return tuple(v / (1.0 + g) for v, g in zip(xyz, temperature.polynomial(p, at), strict=True))


def jacobian(xyz, p, at: Conditions):
    """Derivatives of (1)."""
    x = np.asarray(xyz)
    gain = np.stack([np.broadcast_to(1.0 + g, x.shape[1:]) for g in temperature.polynomial(p, at)])
    return gain, temperature.powers(p, at, x.shape[1]) * x[:, None]


SENSITIVITY_TEMPERATURE = Effect(
    "sensitivity_temperature",
    "y_i = x_i (1 + sum a_ik dT^k)",
    "thesis 3.22, fig. 6.18-6.19; article 3.1",
    params,
    forward,
    undo,
    jacobian,
    requires=("temp_c",),
)
