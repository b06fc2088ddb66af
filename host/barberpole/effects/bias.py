"""Bias: a constant added to each reading (thesis 4.4 and 4.7).

    y_i = x_i + b_i + s o_i                                                          (1)

b is the field-like part that every reading carries: hard iron (4.4) seen through the gain, or the offset left after
demodulation. Nothing in a log separates a hard-iron field from it, so `hard_iron` is an alias. o is the offset of the
bridge itself (3.37-3.38): constant in raw readings, hence alternating with the state s once RESET readings are
brought to the sign of SET. It exists only where both raw states are in the log; demodulation removes it (3.43).
"""

import numpy as np

from barberpole.effects.effect import Conditions, Effect, Setup, per_axis


def params(setup: Setup):
    """b in LSB, and o in LSB where raw SET and RESET readings are both there."""
    field_like = per_axis("LSB", typical=10.0 * setup.lsb_per_ut)
    bridge = per_axis("LSB", prefix="bridge_", typical=10.0 * setup.lsb_per_ut)
    return field_like + bridge if setup.flipping == "raw" else field_like


def offsets(p, at: Conditions):
    """The three offsets in LSB, for the state of each sample."""
    return [p[i] + at.state * p[3 + i] if len(p) == 6 else p[i] for i in range(3)]


def forward(xyz, p, at: Conditions):
    """Eq. (1), LSB."""
    x, y, z = xyz
    b_x, b_y, b_z = offsets(p, at)
    return x + b_x, y + b_y, z + b_z


def undo(xyz, p, at: Conditions):
    """Inverse of (1)."""
    x, y, z = xyz
    b_x, b_y, b_z = offsets(p, at)
    return x - b_x, y - b_y, z - b_z


def jacobian(xyz, p, at: Conditions):
    """Slopes of (1)."""
    if len(p) == 3:
        return None, np.ones((3, 1))
    alternating = np.atleast_1d(np.asarray(at.state, float))
    return None, np.stack([np.ones_like(alternating)] * 3 + [alternating] * 3)


BIAS = Effect(
    "bias",
    "y_i = x_i + b_i + s o_i",
    "thesis 4.4, 4.7, 3.37-3.43",
    params,
    forward,
    undo,
    jacobian,
    affine=True,
    summary="a constant is added to each axis: hard iron, or the offset of bridge and amplifier",
)
