"""Mains: the field of power lines and transformers, one sine and cosine on each axis.

    h_i = x_i + s_i sin(2 pi f (t - t_0)) + c_i cos(2 pi f (t - t_0))                (1)

At fewer than 100 samples a second 50 Hz shows at the frequency it is folded to, |f - m f_s|: the fit takes whichever
f explains the samples, and cannot tell one from the other. f comes from the diagnosis (setting `frequency_hz`) and is
refined by the fit; it must be right to a fraction of the inverse of the log's length before that.
"""

import numpy as np

from barberpole.effects import scan
from barberpole.effects.effect import Array, Conditions, Effect, Param, Setup, Shape, per_axis

MAINS_HZ = 50.0


def params(setup: Setup):
    """s and c in µT, f in Hz."""
    f = float(setup.settings.get("frequency_hz", MAINS_HZ))
    size = 0.005 * setup.span_ut
    return (
        *per_axis("uT", prefix="sin_", typical=size),
        *per_axis("uT", prefix="cos_", typical=size),
        Param("frequency", "Hz", f, f - 1.0 / setup.duration_s, f + 1.0 / setup.duration_s, None, f, inner=True),
    )


def _waves(p, at: Conditions):
    phase = 2.0 * np.pi * p[6] * (np.asarray(at.t_s) - at.t0_s)
    return np.sin(phase), np.cos(phase)


def forward(xyz, p, at: Conditions):
    """Eq. (1), µT."""
    sine, cosine = _waves(p, at)
    return tuple(xyz[i] + p[i] * sine + p[3 + i] * cosine for i in range(3))


def undo(xyz, p, at: Conditions):
    """Inverse of (1)."""
    sine, cosine = _waves(p, at)
    return tuple(xyz[i] - p[i] * sine - p[3 + i] * cosine for i in range(3))


def jacobian(xyz, p, at: Conditions):
    """Slopes of (1)."""
    sine, cosine = _waves(p, at)
    d_p = np.zeros((3, 7, sine.size))
    for axis in range(3):
        d_p[axis, axis], d_p[axis, 3 + axis] = sine, cosine
        d_p[axis, 6] = 2.0 * np.pi * (np.asarray(at.t_s) - at.t0_s) * (p[axis] * cosine - p[3 + axis] * sine)
    return None, d_p


def search(setup: Setup, at: Conditions, reading: Array, residual: Array):
    """The strongest line in the residual (m, n)."""
    f, tried = scan.line(np.asarray(at.t_s), residual, setup.interval_s)
    if not tried:
        return ()
    return (Shape(inner={"frequency": f}, settings={"frequency_hz": f}, tried=tried),)


MAINS = Effect(
    "mains",
    "h_i = x_i + s_i sin(2 pi f t) + c_i cos(2 pi f t)",
    "thesis 4.1 (disturbing fields); sampling theorem",
    params,
    forward,
    undo,
    jacobian,
    requires=("t_s",),
    summary="an alternating field of one frequency is added",
    off_board="the phase of the mains is not known at the next power-up",
    shapes=lambda setup: (Shape(),) if "frequency_hz" in setup.settings else (),
    search=search,
    settings=("frequency_hz",),
)
