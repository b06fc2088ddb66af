"""Soft iron: magnetisable parts that turn with the sensor draw the field into themselves (thesis 4.3).

    B'_i = B_i + sum_j S_ij B_j,   S symmetric                                       (1)

The field that induced magnetisation adds is a symmetric matrix times the applied one, where the part responds in
proportion and without memory. Its diagonal cannot be told from `scale`, and is there only on request: setting
`diagonal = true`. Beside `misalignment` with a vector reference nothing of it is left to see.
"""

import numpy as np

from barberpole.effects.effect import Conditions, Effect, Param, Setup

PLACES = ((0, 1), (0, 2), (1, 2), (0, 0), (1, 1), (2, 2))
_SUSCEPTIBILITY = {"unit": "1", "lower": -0.45, "upper": 0.45, "typical": 0.02}


def params(setup: Setup):
    """S_xy, S_xz, S_yz and, if asked for, S_xx, S_yy, S_zz; dimensionless."""
    places = PLACES if setup.settings.get("diagonal", False) else PLACES[:3]
    return tuple(Param("xyz"[i] + "xyz"[j], **_SUSCEPTIBILITY) for i, j in places)


def matrix(p):
    """I + S of (1), (3, 3)."""
    out = np.eye(3, dtype=np.result_type(np.asarray(p), float))
    for (i, j), value in zip(PLACES, p, strict=False):
        out[i, j] += value
        if i != j:
            out[j, i] += value
    return out


def forward(xyz, p, at: Conditions):
    """Eq. (1), µT."""
    return tuple(matrix(p) @ np.asarray(xyz))


def undo(xyz, p, at: Conditions):
    """Inverse of (1)."""
    x, y, z = xyz
    return tuple(float(a) * x + float(b) * y + float(c) * z for a, b, c in np.linalg.inv(matrix(p)))


def jacobian(xyz, p, at: Conditions):
    """Slopes of (1)."""
    field = np.asarray(xyz)
    d_p = np.zeros((3, len(p), field.shape[1]))
    for column, (i, j) in enumerate(PLACES[: len(p)]):
        d_p[i, column] = field[j]
        d_p[j, column] = field[i]
    return matrix(p)[:, :, None], d_p


SOFT_IRON = Effect(
    "soft_iron",
    "B'_i = B_i + sum S_ij B_j, S symmetric",
    "thesis 4.3, 4.6",
    params,
    forward,
    undo,
    jacobian,
    affine=True,
    summary="iron that turns with the sensor bends the field towards itself",
    settings=("diagonal",),
)
