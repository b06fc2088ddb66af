"""Load current: the wires of the host platform add a field in proportion to their current.

    B'_i = B_i + m_i I                                                               (1)

Biot and Savart's law with the wiring held still; I is the platform's current, column load_a. The thesis counts
current-carrying wires among the sources of hard iron (4.1.4): here they are allowed to vary.
"""

import numpy as np

from barberpole.effects.effect import Conditions, Effect, Setup, per_axis


def params(setup: Setup):
    """m in µT/A."""
    return per_axis("uT/A", typical=0.01 * setup.span_ut / max(setup.load_a, 1e-9))


def forward(xyz, p, at: Conditions):
    """Eq. (1), µT."""
    return tuple(v + m * at.load_a for v, m in zip(xyz, p, strict=True))


def undo(xyz, p, at: Conditions):
    """Inverse of (1)."""
    return tuple(v - m * at.load_a for v, m in zip(xyz, p, strict=True))


def jacobian(xyz, p, at: Conditions):
    """Slopes of (1)."""
    return None, np.broadcast_to(np.asarray(at.load_a, float), np.shape(xyz))


LOAD_CURRENT = Effect(
    "load_current",
    "B'_i = B_i + m_i I",
    "thesis 4.1.4; Biot and Savart",
    params,
    forward,
    undo,
    jacobian,
    requires=("load_a",),
    summary="the current of the host platform adds a field",
    off_board="the board does not measure the platform's current",
)
