"""Lag: the field reaches the bridge, or the converter, through a first-order low-pass.

    tau_i dy_i/dt + y_i = x_i                                                        (1)

Eddy currents in metal nearby, the amplifier's and the converter's filters: the article finds 3 to 10 % of amplitude
lost at 61 Hz (3.1, fig. 6). (1) is taken by backward differences over the log's own time steps,
y_k = y_(k-1) + dt / (tau + dt) (x_k - y_(k-1)), so that tau = 0 is exactly no lag and d y / d tau = -dx/dt there.
The first sample is taken as settled. Setting `axes = "common"`: one tau for all.
"""

from typing import Any

import numpy as np

from barberpole.effects import series
from barberpole.effects.effect import Conditions, Effect, Param, Setup, Shape, per_axis


def params(setup: Setup):
    """tau in s, of each axis or one for all."""
    limits: dict[str, Any] = {"lower": 0.0, "upper": 0.25 * setup.duration_s, "typical": setup.interval_s}
    if setup.named("axes", "each", "common") == "common":
        return (Param("tau", "s", **limits),)
    return per_axis("s", prefix="tau_", **limits)


def _each(p):
    return p if len(p) == 3 else (p[0],) * 3


def forward(xyz, p, at: Conditions):
    """Eq. (1), µT."""
    rows = np.asarray(xyz)
    rows = rows.astype(np.result_type(rows, np.asarray(p)))
    return tuple(series.filtered(rows, _each(p), at, series.low_pass))


def undo(xyz, p, at: Conditions):
    """Inverse of (1): x = y + tau dy/dt. It raises the noise by about tau over the time step."""
    return tuple(series.filtered(np.asarray(xyz), _each(p), at, series.high_pass))


def tangent(xyz, p, at: Conditions, chain):
    """(1) is linear in x."""
    return series.filtered(chain, _each(p), at, series.low_pass) if np.any(p) else chain


def joint(xyz, p, at: Conditions):
    """(1), unity by the field of the same sample (`tangent` has the rest), and its derivative by tau."""
    out = np.asarray(forward(xyz, p, at))
    by_tau = series.filtered(out, _each(p), at, series.low_pass_by_tau)
    return out, None, by_tau if len(p) == 3 else by_tau[:, None]


def shapes(setup: Setup):
    """The derivative at the null holds while tau is below the time step; longer ones show after steps."""
    return Shape(), Shape(secant=3.0), Shape(secant=10.0), Shape(secant=30.0)


LAG = Effect(
    "lag",
    "tau_i dy_i/dt + y_i = x_i",
    "article 2.4, 3.1, fig. 6",
    params,
    forward,
    undo,
    requires=("t_s",),
    summary="the reading follows the field with a delay",
    joint=joint,
    memory=True,
    tangent=tangent,
    off_board="its undo needs the reading before and the time between",
    shapes=shapes,
    settings=("axes",),
)
