"""Cross-field effect: the field along a bridge's easy axis changes its gain, and the law itself is not linear.

The film is one domain that turns by the angle phi until the torques balance (thesis 3.3), here with k = 1/H_k:

    sin(phi) cos(phi) = k (H_s cos(phi) - s H_e sin(phi))                            (1)
    f = H_s cos(phi) - s H_e sin(phi) = H_k sin(phi) cos(phi)                        (2)

H_s is the field along the sensitive axis, H_e that along the easy axis (`at.easy_axis`), s = +1 after SET and -1 after
RESET, and f is what the bridge reports, scaled so that f -> H_s for k -> 0. To first order f = H_s / (1 + k s H_e)
(3.14); averaged over SET and RESET the linear term goes and H_s (1 + (k H_e)^2 - ...) is left (3.34, 5.7). (1) is
solved exactly, never by its series. A negative k says that the easy axis points the other way.

An offset coil acts on its own die only (thesis 6.2.1): `at.coil_ut` adds to H_s and not to a neighbour's H_e.
"""

import numpy as np

from barberpole.effects.effect import Conditions, Effect, Setup, Shape, per_axis
from barberpole.effects.film import eliminate, sine_cosine, tilt


def params(setup: Setup):
    """k = 1/H_k of each bridge in 1/µT, bounded so that (1) stays on its branch over the field seen."""
    setup.named("form", "demodulated", "unflipped")
    limit = 0.45 / max(setup.span_ut, 1e-9)
    typical = min(1.0 / float(np.mean(setup.anisotropy_ut)), 0.5 * limit)
    return per_axis("1/uT", lower=-limit, upper=limit, start=typical, typical=typical)


def _fields(xyz, at: Conditions):
    """H_s and s H_e of each die, (3, n)."""
    h = np.asarray(xyz)
    coil = np.asarray(at.coil_ut)
    own = h + (coil if coil.ndim == h.ndim else coil[:, None])
    return own, np.asarray(at.state) * h[list(at.easy_axis)]


def forward(xyz, p, at: Conditions):
    """Eq. (2), µT, for one magnetisation (|s| = 1)."""
    own, easy = _fields(xyz, at)
    t = tilt(own, easy, np.asarray(p)[:, None])
    return tuple((own - easy * t) / np.sqrt(1.0 + t * t))


def undo(xyz, p, at: Conditions):
    """Exact inverse of (2) for one magnetisation.

    f gives the angle at once, sin(phi) cos(phi) = k f; then (2) is linear in the three fields,
    H_s = (f + s H_e sin(phi)) / cos(phi), and is solved by elimination.
    """
    sin, cos = zip(*(sine_cosine(k * f) for k, f in zip(p, xyz, strict=True)), strict=True)
    slope = [at.state * s / c for s, c in zip(sin, cos, strict=True)]
    level = [f / c for f, c in zip(xyz, cos, strict=True)]
    # a coil's field sits in the neighbour's own reading but not in this die's easy axis
    level = [v - slope[i] * at.coil_ut[at.easy_axis[i]] for i, v in enumerate(level)]
    own = eliminate(level, slope, at.easy_axis)
    return tuple(own[i] - at.coil_ut[i] for i in range(3))


def joint(xyz, p, at: Conditions):
    """(2) and its slopes, through the implicit function theorem on (1)."""
    own, easy = _fields(xyz, at)
    k = np.asarray(p, float)[:, None]
    t = tilt(own, easy, k)
    r = np.sqrt(1.0 + t * t)
    torque = own - easy * t
    steep = 1.0 + k * (easy * r - torque * t / r)
    along = -(easy + torque * t / (r * r)) / (r * steep)  # d f / d t over the slope of (1)
    d_in = np.zeros((3, *own.shape))
    d_easy = (-t / r - along * k * t * r) * np.asarray(at.state, float)
    for i in range(3):
        d_in[i, i] = (1.0 / r + along * k * r)[i]
        d_in[i, at.easy_axis[i]] += d_easy[i]
    return torque / r, d_in, along * torque * r


def shapes(setup: Setup):
    """Demodulated readings are even in k: nothing shows at the null. Those of unknown state may be of either form."""
    if setup.flipping != "none":
        return (Shape(),)
    return Shape(settings={"form": "unflipped"}), Shape(settings={"form": "demodulated"}, secant=1.0)


CROSS_FIELD = Effect(
    "cross_field",
    "sin(phi) cos(phi) = k (H_s cos(phi) - s H_e sin(phi)), y = H_s cos(phi) - s H_e sin(phi)",
    "thesis 3.3, 3.13-3.14, 3.28-3.36, 5.6-5.9",
    params,
    forward,
    undo,
    flips=True,
    summary="the field along a bridge's easy axis changes its sensitivity",
    joint=joint,
    shapes=shapes,
    settings=("form",),
)
