"""Scale: the sensitivity of each axis at zero field and reference temperature (thesis 4.1).

    y_i = S_i g_i h_i                                                                (1)

S in LSB/µT; g is today's gain over the calibrated one, measured through the offset coils at power-up (thesis 6.7),
1 everywhere else. Null S = 1: one LSB per µT.
"""

import numpy as np

from barberpole.effects.effect import Conditions, Effect, Setup, per_axis


def params(setup: Setup):
    """S_x, S_y, S_z in LSB/µT."""
    return per_axis("LSB/uT", null=1.0, start=setup.lsb_per_ut, typical=0.1 * setup.lsb_per_ut)


def forward(xyz, p, at: Conditions):
    """Eq. (1): µT to LSB."""
    return tuple(p[i] * at.gain[i] * xyz[i] for i in range(3))


def undo(xyz, p, at: Conditions):
    """Inverse of (1): LSB to µT."""
    return tuple(xyz[i] * (1.0 / p[i]) / at.gain[i] for i in range(3))


def jacobian(xyz, p, at: Conditions):
    """Slopes of (1)."""
    gain = np.asarray(at.gain, float)[:, None]
    return np.asarray(p, float)[:, None] * gain, gain * np.asarray(xyz)


SCALE = Effect(
    "scale",
    "y_i = S_i h_i",
    "thesis 4.1, 6.7",
    params,
    forward,
    undo,
    jacobian,
    affine=True,
    summary="each axis has its own sensitivity",
)
