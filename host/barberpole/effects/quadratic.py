"""Quadratic: the response of an axis is bent, differently for fields of either sign.

    y_i = x_i + q_i x_i^2                                                            (1)

The second-order on-axis term of the article's polynomial model (eq. 5, m = 2), written from field to reading. Unlike
`cross_field` it knows neither the other axes nor SET from RESET.
"""

import numpy as np

from barberpole.effects.effect import Conditions, Effect, Setup, per_axis


def params(setup: Setup):
    """q in 1/µT, bounded so that (1) stays rising over one and a quarter of the span."""
    return per_axis("1/uT", lower=-0.4 / setup.span_ut, upper=0.4 / setup.span_ut, typical=0.005 / setup.span_ut)


def forward(xyz, p, at: Conditions):
    """Eq. (1), µT."""
    return tuple(x * (1.0 + q * x) for x, q in zip(xyz, p, strict=True))


def undo(xyz, p, at: Conditions):
    """Inverse of (1), exact: the root that is x = y for q = 0."""
    return tuple(y * 2.0 / (1.0 + np.sqrt(1.0 + 4.0 * q * y)) for y, q in zip(xyz, p, strict=True))


def jacobian(xyz, p, at: Conditions):
    """Slopes of (1)."""
    x = np.asarray(xyz)
    return 1.0 + 2.0 * np.asarray(p, float)[:, None] * x, x * x


QUADRATIC = Effect(
    "quadratic",
    "y_i = x_i + q_i x_i^2",
    "article eq. 4-5, m = 2",
    params,
    forward,
    undo,
    jacobian,
    summary="each axis answers with a little of the square of its field",
)
