"""Misalignment: the sensitive directions are not the axes of the reference frame (thesis 4.2).

    h_i = (B_i + sum_j e_ij B_j) / sqrt(1 + sum_j e_ij^2)                            (1)

e_ij is the tangent of the angle from axis i towards axis j; each row is a unit vector, so that `scale` stays the true
sensitivity at any mounting angle (the article's norm of the base vector, 2.2.1). With a vector reference all six e_ij
can be seen; when only the magnitude is known a common rotation cannot, and the upper triangle remains (4.15-4.18).
"""

import numpy as np

from barberpole.effects.effect import Conditions, Effect, Param, Setup

UPPER = ("xy", "xz", "yz")
LOWER = ("yx", "zx", "zy")
PLACES = tuple(("xyz".index(i), "xyz".index(j)) for i, j in UPPER + LOWER)
ROWS, COLUMNS = np.array(PLACES).T
ANGLES = tuple(Param(name, unit="rad", typical=0.02, lower=-20.0, upper=20.0) for name in UPPER + LOWER)


def params(setup: Setup):
    """The e_ij that this reference can determine, in rad (tangents)."""
    return ANGLES if setup.reference == "vector" else ANGLES[: len(UPPER)]


def matrix(p):
    """The rows of (1), 3 x 3, unit norm."""
    rows = np.eye(3, dtype=np.result_type(np.asarray(p), float))
    rows[ROWS[: len(p)], COLUMNS[: len(p)]] = p
    return rows / np.sqrt(np.sum(rows * rows, axis=1))[:, None]


def forward(xyz, p, at: Conditions):
    """Eq. (1), µT."""
    return tuple(matrix(p) @ np.asarray(xyz))


def undo(xyz, p, at: Conditions):
    """Inverse of (1)."""
    x, y, z = xyz
    return tuple(float(a) * x + float(b) * y + float(c) * z for a, b, c in np.linalg.inv(matrix(p)))


def joint(xyz, p, at: Conditions):
    """(1) and its slopes."""
    unit, field = matrix(p), np.asarray(xyz)
    out = unit @ field
    d_p = np.zeros((3, len(p), field.shape[1]))
    column = np.arange(len(p))
    i, j = ROWS[column], COLUMNS[column]
    d_p[i, column] = unit[i, i, None] * (field[j] - unit[i, j, None] * out[i])  # d (row / |row|) / d e_ij
    return out, unit[:, :, None], d_p


MISALIGNMENT = Effect(
    "misalignment",
    "h_i = (B_i + sum e_ij B_j) / norm",
    "thesis 4.2, 4.15-4.18; article 2.2.1",
    params,
    forward,
    undo,
    joint=joint,
    affine=True,
    summary="the sensitive axes are not at right angles, or not along the axes of the reference",
)
