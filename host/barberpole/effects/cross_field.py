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

from barberpole.effects.effect import Conditions, Effect, Setup, per_axis

NEWTON_STEPS = 5  # quadratic convergence: below 1e-15 for |k H| < 0.3


def params(setup: Setup):
    """k = 1/H_k of each bridge in 1/µT, bounded so that (1) stays on its branch over the field seen."""
    limit = 0.45 / max(setup.span_ut, 1e-9)
    typical = min(1.0 / float(np.mean(setup.anisotropy_ut)), 0.5 * limit)
    return per_axis("1/uT", lower=-limit, upper=limit, start=typical, typical=typical)


def _fields(xyz, at: Conditions):
    """H_s and s H_e of each die, (3, n)."""
    h = np.asarray(xyz)
    coil = np.asarray(at.coil_ut)
    own = h + (coil if coil.ndim == h.ndim else coil[:, None])
    return own, np.asarray(at.state) * h[list(at.easy_axis)]


def _tangent(own, easy, k):
    """t = tan(phi) of (1): t = k (H_s - s H_e t) sqrt(1 + t^2), by Newton from the linear answer."""
    t = k * own / (1.0 + k * easy)
    for _ in range(NEWTON_STEPS):
        r = np.sqrt(1.0 + t * t)
        torque = own - easy * t
        t = t - (t - k * torque * r) / (1.0 + k * easy * r - k * torque * t / r)
    return t


def forward(xyz, p, at: Conditions):
    """Eq. (2), µT, for one magnetisation (|s| = 1)."""
    own, easy = _fields(xyz, at)
    k = np.asarray(p)[:, None]
    t = _tangent(own, easy, k)
    return tuple((own - easy * t) / np.sqrt(1.0 + t * t))


def undo(xyz, p, at: Conditions):
    """Exact inverse of (2) for one magnetisation.

    f gives the angle at once, sin(phi) cos(phi) = k f; then (2) is linear in the three fields,
    H_s = (f + s H_e sin(phi)) / cos(phi), and is solved by elimination.
    """
    sin, cos = zip(*(_sine_cosine(k * f) for k, f in zip(p, xyz, strict=True)), strict=True)
    slope = [at.state * s / c for s, c in zip(sin, cos, strict=True)]
    level = [f / c for f, c in zip(xyz, cos, strict=True)]
    # a coil's field sits in the neighbour's own reading but not in this die's easy axis
    level = [v - slope[i] * at.coil_ut[at.easy_axis[i]] for i, v in enumerate(level)]
    own = _eliminate(level, slope, at.easy_axis)
    return tuple(own[i] - at.coil_ut[i] for i in range(3))


def _sine_cosine(u):
    """sin and cos of phi from u = sin(phi) cos(phi), |phi| < 45 degrees."""
    cos = np.sqrt(0.5 + 0.5 * np.sqrt(1.0 - 4.0 * u * u))
    return u / cos, cos


def _eliminate(level, slope, easy):
    """Solve h_i = level_i + slope_i h_easy(i) for the three h: every chain of easy axes ends in a pair or a triple."""
    solved: list = [None, None, None]
    for i in range(3):
        j = easy[i]
        if easy[j] == i:
            solved[i] = (level[i] + slope[i] * level[j]) / (1.0 - slope[i] * slope[j])
        elif easy[easy[j]] == i:
            m = easy[j]
            solved[i] = (level[i] + slope[i] * (level[j] + slope[j] * level[m])) / (1.0 - slope[i] * slope[j] * slope[m])
    for i in range(3):
        if solved[i] is None:
            solved[i] = level[i] + slope[i] * solved[easy[i]]
    return solved


def jacobian(xyz, p, at: Conditions):
    """Derivatives of (2), through the implicit function theorem on (1)."""
    own, easy = _fields(xyz, at)
    k = np.asarray(p, float)[:, None]
    t = _tangent(own, easy, k)
    r = np.sqrt(1.0 + t * t)
    torque = own - easy * t
    steep = 1.0 + k * easy * r - k * torque * t / r
    along = -(easy + torque * t / (r * r)) / r  # d f / d t
    d_own = 1.0 / r + along * k * r / steep
    d_easy = -t / r - along * k * t * r / steep
    d_in = np.zeros((3, *own.shape))
    d_p = np.zeros((3, 3, own.shape[1]))
    sign = np.broadcast_to(np.asarray(at.state, float), own.shape)
    for i in range(3):
        d_in[i, i] = d_own[i]
        d_in[i, at.easy_axis[i]] += sign[i] * d_easy[i]
        d_p[i, i] = (along * torque * r / steep)[i]
    return d_in, d_p


CROSS_FIELD = Effect(
    "cross_field",
    "sin(phi) cos(phi) = k (H_s cos(phi) - s H_e sin(phi)), y = H_s cos(phi) - s H_e sin(phi)",
    "thesis 3.3, 3.13-3.14, 3.28-3.36, 5.6-5.9",
    params,
    forward,
    undo,
    jacobian,
    flips=True,
)
