"""Coil heating: the current of the coils warms the dies, and with them offset and sensitivity move.

    w_i = Q_i + a sum_(j != i) Q_j,   tau dQ_i/dt + Q_i = I_i^2                      (1)
    y_i = x_i (1 + g_i w_i) + b_i w_i                                                (2)

The heat of a coil of resistance R is R I^2; its own die takes it first, and a share a reaches the neighbours. The die
follows with the thermal time constant tau (0: at once) and is cold before the first sample. Offset and sensitivity then
follow temperature as in `bias_temperature` and `sensitivity_temperature`, though the sensor's thermometer may not have
noticed. An offset coil of 50 ohm (thesis 6.2.1) at 10 mA makes 5 mW. R and the temperature coefficients are all in b
and g.
"""

import numpy as np

from barberpole.effects import series
from barberpole.effects.effect import Conditions, Effect, Param, Setup, Shape, per_axis


def params(setup: Setup):
    """b in LSB/mA², g in 1/mA², the share a, and tau in s."""
    square = max(setup.current_ma, 1e-9) ** 2
    tau = float(setup.settings.get("tau_s", 0.0))
    share = float(setup.settings.get("share", 0.0))
    return (
        *per_axis("LSB/mA^2", prefix="bias_", typical=0.1 * setup.lsb_per_ut / square),
        *per_axis("1/mA^2", prefix="gain_", typical=0.005 / square),
        Param("share", "1", share, 0.0, 1.0, typical=1.0, inner=True),
        Param("tau", "s", tau, 0.0, max(setup.duration_s, tau), typical=0.1 * setup.duration_s, inner=True),
    )


def _heats(p, at: Conditions):
    """Q (3, n) of (1)."""
    square = np.asarray(at.i_ma, float) ** 2 + 0.0 * p[7]
    return series.filtered(square, (p[7],) * 3, at, series.warm_up) if p[7] else square


def _warmth(heats, share):
    """w (3, n) of (1)."""
    return heats + share * (np.sum(heats, axis=0) - heats)


def forward(xyz, p, at: Conditions):
    """Eq. (2), LSB."""
    if at.i_ma is None:  # only on the board, whose coils are off while it measures
        return tuple(xyz)
    warmth = _warmth(_heats(p, at), p[6])
    return tuple(xyz[i] * (1.0 + p[3 + i] * warmth[i]) + p[i] * warmth[i] for i in range(3))


def undo(xyz, p, at: Conditions):
    """Inverse of (2)."""
    if at.i_ma is None:
        return tuple(xyz)
    warmth = _warmth(_heats(p, at), p[6])
    return tuple((xyz[i] - p[i] * warmth[i]) / (1.0 + p[3 + i] * warmth[i]) for i in range(3))


def jacobian(xyz, p, at: Conditions):
    """Slopes of (2)."""
    x, p = np.asarray(xyz), np.asarray(p, float)
    heats = _heats(p, at)
    warmth, response = _warmth(heats, p[6]), p[3:6, None] * x + p[:3, None]
    by_tau = series.filtered(heats, (p[7],) * 3, at, series.warm_up_by_tau)
    d_p = np.zeros((3, 8, x.shape[1]))
    for axis in range(3):
        d_p[axis, axis] = warmth[axis]
        d_p[axis, 3 + axis] = x[axis] * warmth[axis]
    d_p[:, 6] = response * (np.sum(heats, axis=0) - heats)
    d_p[:, 7] = response * _warmth(by_tau, p[6])
    return 1.0 + p[3:6, None] * warmth, d_p


def shapes(setup: Setup):
    """Each die by its own coil or all alike; at once, or with a twentieth or a fifth of the log's length."""
    found = []
    for share in (0.0, 1.0):
        for part in (0.0, 0.05, 0.2):
            inner = {"share": share, "tau": part * setup.duration_s}
            found.append(Shape(inner=inner, settings={"share": share, "tau_s": inner["tau"]}))
    return tuple(found)


COIL_HEATING = Effect(
    "coil_heating",
    "y_i = x_i (1 + g_i w_i) + b_i w_i, w_i = low-pass of I_i^2 + a sum of the others'",
    "Joule's law; thesis 3.2, 6.2.1",
    params,
    forward,
    undo,
    jacobian,
    requires=("i_ma", "t_s"),
    summary="the heat of the coil currents moves offset and sensitivity",
    memory=True,
    shapes=shapes,
    settings=("tau_s", "share"),
)
