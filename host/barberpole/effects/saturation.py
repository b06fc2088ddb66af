"""Saturation: towards the end of the range the reading grows less and less.

    y_i = x_i / sqrt(1 + (x_i / L_i)^2)                                              (1)

L is the level that the reading cannot pass: the film's magnetisation in line with the field (thesis 3.9: sin(phi)
reaches 1), or the amplifier's rail. We fit v = 1/L^2, which is 0 for no saturation. (1) follows a hyperbolic tangent
of the same cubic term within 2 % of L up to x = L, and is undone exactly. While x is well below L, y = x - v x^3/2 and
no reading tells it from a falling `cubic`.
"""

import numpy as np

from barberpole.effects.effect import Conditions, Effect, Setup, Shape, per_axis


def params(setup: Setup):
    """v = 1/L² in 1/µT²: L is at least three quarters of the largest field seen (the span is one and a half)."""
    span = setup.span_ut * setup.span_ut
    return per_axis("1/uT^2", lower=0.0, upper=4.0 / span, typical=0.01 / span)


def forward(xyz, p, at: Conditions):
    """Eq. (1), µT."""
    return tuple(x / np.sqrt(1.0 + v * x * x) for x, v in zip(xyz, p, strict=True))


def undo(xyz, p, at: Conditions):
    """Inverse of (1), exact."""
    return tuple(y / np.sqrt(1.0 - v * y * y) for y, v in zip(xyz, p, strict=True))


def jacobian(xyz, p, at: Conditions):
    """Slopes of (1)."""
    x = np.asarray(xyz)
    square = x * x
    rise = 1.0 + np.asarray(p, float)[:, None] * square
    steep = 1.0 / (rise * np.sqrt(rise))
    return steep, -0.5 * x * square * steep


SATURATION = Effect(
    "saturation",
    "y_i = x_i / sqrt(1 + (x_i / L_i)^2)",
    "thesis 3.5-3.9",
    params,
    forward,
    undo,
    jacobian,
    summary="the reading flattens towards the end of the range",
    shapes=lambda setup: (Shape(), Shape(secant=50.0)),
)
