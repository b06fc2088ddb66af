"""Hysteresis: after a turning point the reading stays behind until the field has gone back by a certain width.

    y_i = x_i + sum_j w_ij (z_ij - x_i),   z_ij = play of half width r j/m           (1)

The play z stands still while |x - z| < r and is dragged along beyond: a sum of plays is the model of Prandtl and
Ishlinskii. One play by default, closed loops 2 w r high; setting `plays = m` rounds their corners with more widths.
Domain walls of an unflipped film and of iron nearby do this; a SET or RESET pulse wipes that of the film (thesis 3.4,
3.6). The first sample is taken as demagnetised, z = x. The inverse is a sum of plays as well (Krejci and Kuhnen, IEE
Proc. Control Theory Appl. 148 (2001) 185): with S_j = 1 - sum of the weights beyond j and r_j = r j/m,

    x = y / S_0 + sum_j (1/S_j - 1/S_(j-1)) play of y with half width sum_(l<=j) S_(l-1) (r_l - r_(l-1))      (2)
"""

import numpy as np

from barberpole.effects import series
from barberpole.effects.effect import Conditions, Effect, Param, Setup, Shape, per_axis
from barberpole.effects.play import contacts, play
from barberpole.errors import InputError, must

MAX_PLAYS = 4
WIDTHS = (0.02, 0.1, 0.3)  # of the span: what a search begins from


def params(setup: Setup):
    """Weights w (dimensionless) of each play and axis, and the largest half width r in µT."""
    plays = setup.settings.get("plays", 1)
    if not isinstance(plays, int) or not 1 <= plays <= MAX_PLAYS:
        raise InputError(must("setting plays", f"a whole number from 1 to {MAX_PLAYS}", repr(plays)))
    span = setup.span_ut
    width = float(setup.settings.get("width_ut", 0.1 * span))
    limits = {"lower": -0.8 / plays, "upper": 0.8 / plays, "typical": 0.05}
    weights = [per_axis("1", prefix=f"weight{j or ''}_", **limits) for j in range(plays)]
    return *(w for group in weights for w in group), Param("width", "uT", width, 1e-3 * span, span, None, width, True)


def _plays(p):
    """Weights (m, 3) and half widths (m,)."""
    weights = np.reshape(np.asarray(p[:-1]), (-1, 3))
    return weights, p[-1] * np.arange(1, len(weights) + 1) / len(weights)


def forward(xyz, p, at: Conditions):
    """Eq. (1), µT."""
    x = np.asarray(xyz)
    weights, widths = _plays(p)
    out = np.array(x, np.result_type(x, np.asarray(p)))
    for samples in series.streams(at, x.shape[1]):
        for axis in range(3):
            one = x[axis, samples]
            out[axis, samples] += sum(w[axis] * (play(one, r) - one) for w, r in zip(weights, widths, strict=True))
    return tuple(out)


def undo(xyz, p, at: Conditions):
    """Eq. (2)."""
    y = np.asarray(xyz, float)
    weights, widths = _plays(p)
    slope = 1.0 - np.vstack([np.cumsum(weights[::-1], axis=0)[::-1], np.zeros(3)])  # S_0 ... S_m, (m + 1, 3)
    widths = np.cumsum(slope[:-1] * np.diff(widths, prepend=0.0)[:, None], axis=0)
    weights = np.diff(1.0 / slope, axis=0)
    out = y / slope[0][:, None]
    for samples in series.streams(at, y.shape[1]):
        for axis in range(3):
            one = y[axis, samples]
            plays = zip(weights[:, axis], widths[:, axis], strict=True)
            out[axis, samples] += sum(w * play(one, r) for w, r in plays)
    return tuple(out)


def tangent(xyz, p, at: Conditions, chain):
    """Derivatives of the input carried on: a play that stands still keeps that of the sample that moved it last."""
    x, weights, widths = np.asarray(xyz), *_plays(p)
    if not np.any(weights):
        return chain
    out = np.array(chain)
    for samples in series.streams(at, x.shape[1]):
        for axis in range(3):
            one = chain[axis][..., samples]
            for w, r in zip(weights[:, axis], widths, strict=True):
                moved_by = np.take(one, contacts(x[axis, samples], r)[0], axis=-1)
                out[axis][..., samples] += w * (moved_by - one)
    return out


def joint(xyz, p, at: Conditions):
    """(1), unity by the field of the same sample (`tangent` has the rest), and its derivatives by w and r."""
    x, weights, widths = np.asarray(xyz), *_plays(p)
    out, d_p, m = np.array(x), np.zeros((3, len(p), x.shape[1])), len(widths)
    for samples in series.streams(at, x.shape[1]):
        for axis in range(3):
            one = x[axis, samples]
            for j in range(m):
                index, side = contacts(one, widths[j])
                apart = one[index] + side * widths[j] - one
                out[axis, samples] += weights[j, axis] * apart
                d_p[axis, 3 * j + axis, samples] = apart
                d_p[axis, -1, samples] += weights[j, axis] * side * (j + 1) / m
    return out, None, d_p


def shapes(setup: Setup):
    """Loops of a few widths."""
    widths = [factor * setup.span_ut for factor in WIDTHS]
    return tuple(Shape(inner={"width": width}, settings={"width_ut": width}) for width in widths)


HYSTERESIS = Effect(
    "hysteresis",
    "y_i = x_i + sum w_ij (z_ij - x_i), z_ij = play of half width r j/m",
    "thesis 3.4, 3.6; Krejci and Kuhnen 2001",
    params,
    forward,
    undo,
    summary="the reading depends on which way the field came",
    joint=joint,
    memory=True,
    tangent=tangent,
    off_board="its undo needs all readings since the last turning point",
    shapes=shapes,
    settings=("plays", "width_ut"),
)
