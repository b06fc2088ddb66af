"""Coil coupling: a current in one coil adds a field on every axis.

    h_i = x_i + sum_j c_ij I_j                                                       (1)

I_j are the coil currents, columns ix_ma.. of offset or Helmholtz coils. c_jj is the constant of a coil on its own axis
(21.7 mT/A for an offset coil, thesis 6.2.1), the others are its leakage onto the neighbours and the angles of the
windings. An offset coil sits in its own die's package, so (1) acts in the frame of the dies.
"""

import numpy as np

from barberpole.effects.effect import Conditions, Effect, Param, Setup

PLACES = tuple((i, j) for j in range(3) for i in range(3))  # parameter k acts on axis k % 3


def params(setup: Setup):
    """c_ij in µT/mA: named axis, then coil."""
    typical = 0.01 * setup.span_ut / max(setup.current_ma, 1e-9)
    return tuple(Param("xyz"[i] + "xyz"[j], "uT/mA", typical=typical) for i, j in PLACES)


def _fields(p, at: Conditions):
    if at.i_ma is None:  # only on the board, whose coils are off while it measures
        return (0.0, 0.0, 0.0)
    return tuple(sum(p[3 * j + i] * at.i_ma[j] for j in range(3)) for i in range(3))


def forward(xyz, p, at: Conditions):
    """Eq. (1), µT."""
    return tuple(v + field for v, field in zip(xyz, _fields(p, at), strict=True))


def undo(xyz, p, at: Conditions):
    """Inverse of (1)."""
    return tuple(v - field for v, field in zip(xyz, _fields(p, at), strict=True))


def jacobian(xyz, p, at: Conditions):
    """Slopes of (1)."""
    return None, np.repeat(np.asarray(at.i_ma, float), 3, axis=0)


COIL_COUPLING = Effect(
    "coil_coupling",
    "h_i = x_i + sum c_ij I_j",
    "thesis 6.2.1",
    params,
    forward,
    undo,
    jacobian,
    requires=("i_ma",),
    summary="the current of each coil adds a field on every axis",
)
