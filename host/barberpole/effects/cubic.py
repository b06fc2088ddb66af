"""Cubic: the response of an axis steepens or flattens with the field, alike on both sides.

    y_i = x_i + c_i x_i^3                                                            (1)

The third-order on-axis term of the article's polynomial model (eq. 5, m = 3), which takes up to 80 % off the residual
of the HMC5983 and LSM303DLHC (article 3.1, fig. 5), written from field to reading. c < 0 is what a film does before it
saturates: small amounts of it cannot be told from `saturation`.
"""

import numpy as np

from barberpole.effects.effect import Conditions, Effect, Setup, per_axis

STEPS = 3  # of Halley's method, which triples the digits: from 4e-3 to below rounding within the bounds


def params(setup: Setup):
    """c in 1/µT², bounded so that (1) stays rising over 1.29 times the largest field seen, of which the span is 1.5."""
    span = setup.span_ut * setup.span_ut
    return per_axis("1/uT^2", lower=-0.45 / span, upper=1.0 / span, typical=0.005 / span)


def forward(xyz, p, at: Conditions):
    """Eq. (1), µT."""
    return tuple(x * (1.0 + c * x * x) for x, c in zip(xyz, p, strict=True))


def undo(xyz, p, at: Conditions):
    """Inverse of (1) to working accuracy, by Halley's method on the ratio u = x/y: u + c y^2 u^3 = 1."""
    return tuple(y * _ratio(c * y * y) for y, c in zip(xyz, p, strict=True))


def _ratio(d):
    """u of u + d u^3 = 1, from the Padé approximant of the root."""
    u = (1.0 + 2.0 * d) / (1.0 + 3.0 * d)
    for _ in range(STEPS):
        du2 = d * u * u
        gap, slope = u * (1.0 + du2) - 1.0, 1.0 + 3.0 * du2
        u = u - gap * slope / (slope * slope - 3.0 * gap * d * u)
    return u


def jacobian(xyz, p, at: Conditions):
    """Slopes of (1)."""
    x = np.asarray(xyz)
    square = x * x
    return 1.0 + 3.0 * np.asarray(p, float)[:, None] * square, square * x


CUBIC = Effect(
    "cubic",
    "y_i = x_i + c_i x_i^3",
    "article eq. 4-5, m = 3, fig. 5",
    params,
    forward,
    undo,
    jacobian,
    summary="each axis answers with a little of the cube of its field",
)
