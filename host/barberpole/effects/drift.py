"""Drift: the offset of an axis moves with time, whatever the temperature does.

    y_i = x_i + sum_k d_ik (t - t_0)^k                                               (1)

Ageing and stress move the offset slowly (article 3.2: seen, cause not found). Steadily rising temperature looks the
same: only warming and cooling again tells the two apart.
"""

import numpy as np

from barberpole.effects import polynomial
from barberpole.effects.effect import Conditions, Effect, Setup

TYPICAL_UT = 0.5  # over the length of the log


def params(setup: Setup):
    """d_ik in LSB/s^k; order 1 unless the model file says otherwise."""
    typical = TYPICAL_UT * setup.lsb_per_ut / setup.duration_s
    return polynomial.params(setup, "LSB", "s", typical, span=setup.duration_s)


def _time(at: Conditions):
    """Time since the reference in s."""
    return np.asarray(at.t_s, float) - at.t0_s


def forward(xyz, p, at: Conditions):
    """Eq. (1), LSB."""
    return tuple(v + d for v, d in zip(xyz, polynomial.sums(p, _time(at)), strict=True))


def undo(xyz, p, at: Conditions):
    """Inverse of (1)."""
    return tuple(v - d for v, d in zip(xyz, polynomial.sums(p, _time(at)), strict=True))


def jacobian(xyz, p, at: Conditions):
    """Slopes of (1)."""
    return None, polynomial.powers(p, _time(at))


DRIFT = Effect(
    "drift",
    "y_i = x_i + sum d_ik (t - t_0)^k",
    "article 3.2",
    params,
    forward,
    undo,
    jacobian,
    requires=("t_s",),
    summary="the offset of each axis moves with time",
    off_board="the board's clock starts anew at each power-up",
    shapes=lambda setup: polynomial.orders(1, 2),
    settings=("order",),
)
