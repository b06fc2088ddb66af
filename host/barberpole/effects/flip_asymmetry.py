"""Flip asymmetry: SET and RESET do not leave the same sensitivity behind.

    y_i = (1 + s d_i) x_i + s o_i                                                    (1)

s = +1 after SET, -1 after RESET. Thesis 3.37-3.39 assumes equal responses; an incomplete switch gives d. o is the
part that alternates: in raw readings that is the bridge's offset and belongs to `bias`, so it appears here only where
the log's readings were already brought to one sign. Without both states in the log nothing of it can be seen.
"""

import numpy as np

from barberpole.effects.effect import Conditions, Effect, Setup, per_axis


def params(setup: Setup):
    """d (dimensionless) and, for corrected readings, o in LSB."""
    gain = per_axis("1", prefix="gain_", lower=-0.5, upper=0.5, typical=0.01)
    offset = per_axis("LSB", prefix="offset_", typical=setup.lsb_per_ut)
    return gain + offset if setup.flipping == "corrected" else gain


def forward(xyz, p, at: Conditions):
    """Eq. (1), LSB."""
    out = [xyz[i] * (1.0 + at.state * p[i]) for i in range(3)]
    return tuple(out[i] + at.state * p[3 + i] for i in range(3)) if len(p) == 6 else tuple(out)


def undo(xyz, p, at: Conditions):
    """Inverse of (1)."""
    if len(p) == 6:
        xyz = [xyz[i] - at.state * p[3 + i] for i in range(3)]
    return tuple(xyz[i] / (1.0 + at.state * p[i]) for i in range(3))


def jacobian(xyz, p, at: Conditions):
    """Slopes of (1)."""
    x, s = np.asarray(xyz), np.asarray(at.state, float)
    d_p = s * x
    if len(p) == 6:
        d_p = np.concatenate([d_p, np.broadcast_to(s, x.shape)])
    return 1.0 + s * np.asarray(p, float)[:3, None], d_p


FLIP_ASYMMETRY = Effect(
    "flip_asymmetry",
    "y_i = (1 + s d_i) x_i + s o_i",
    "thesis 3.37-3.39, 3.4",
    params,
    forward,
    undo,
    jacobian,
    flips=True,
    summary="SET and RESET leave different sensitivities, or offsets, behind",
)
