"""ADC integral nonlinearity: the converter's code is off by an amount that depends on the code alone.

    y = c + sum_h (s_h sin(2 pi h c / P) + c_h cos(2 pi h c / P)) + q c^2            (1)

Wrong weights of the lower bits repeat every P codes, P a power of two; setting `harmonics = h` follows their corners
more closely. q is the bow of the transfer curve, setting `bow = true`; flipping turns it over, so that it is there by
itself in logs of raw SET and RESET readings. c is the raw code: where RESET readings were brought to the sign of SET,
(1) acts on s c and the result is turned back. P is searched for in the residual (setting `period_lsb`).
"""

import numpy as np

from barberpole.effects import scan
from barberpole.effects.effect import Array, Conditions, Effect, Param, Setup, Shape, per_axis
from barberpole.errors import InputError, must

MAX_HARMONICS = 5
FINEST_LSB = 1.0  # a period has at least two codes
NEWTON_STEPS = 30
DONE = 1e-13


def params(setup: Setup):
    """Sines and cosines in LSB, the bow in 1/LSB, the period in LSB."""
    harmonics = setup.settings.get("harmonics", 1)
    if not isinstance(harmonics, int) or not 0 <= harmonics <= MAX_HARMONICS:
        raise InputError(must("setting harmonics", f"a whole number from 0 to {MAX_HARMONICS}", repr(harmonics)))
    span, period = setup.span_ut * setup.lsb_per_ut, float(setup.settings.get("period_lsb", 64.0))
    found = []
    for h in range(1, harmonics + 1):
        size = {"typical": 0.01 * period / h, "lower": -0.1 * period / h, "upper": 0.1 * period / h}
        found += [*per_axis("LSB", prefix=f"sin{h}_", **size), *per_axis("LSB", prefix=f"cos{h}_", **size)]
    if setup.settings.get("bow", setup.flipping == "raw") or not harmonics:
        found += per_axis("1/LSB", prefix="bow_", typical=0.005 / span, lower=-0.2 / span, upper=0.2 / span)
    return *found, Param("period", "LSB", period, 0.9 * period, 1.1 * period, None, period, inner=True)


def _codes(xyz, at: Conditions):
    """Raw codes (3, n) and the sign that makes them."""
    sign = np.asarray(at.state, float) if at.raw_polarity else 1.0
    return sign * np.asarray(xyz), sign


def _error(codes, p):
    """What (1) adds to the codes (3, n), and its slope by the code."""
    error, slope = 0.0 * (codes * p[-1]), 0.0 * (codes * p[-1])
    for h in range((len(p) - 1) // 6):
        sin, cos = np.asarray(p[6 * h : 6 * h + 3])[:, None], np.asarray(p[6 * h + 3 : 6 * h + 6])[:, None]
        turn = 2.0 * np.pi * (h + 1) / p[-1]
        sine, cosine = np.sin(turn * codes), np.cos(turn * codes)
        error = error + sin * sine + cos * cosine
        slope = slope + turn * (sin * cosine - cos * sine)
    if (len(p) - 1) % 6:
        bow = np.asarray(p[-4:-1])[:, None]
        error, slope = error + bow * codes * codes, slope + 2.0 * bow * codes
    return error, slope


def forward(xyz, p, at: Conditions):
    """Eq. (1), LSB."""
    codes, sign = _codes(xyz, at)
    return tuple(np.asarray(xyz) + sign * _error(codes, p)[0])


def undo(xyz, p, at: Conditions):
    """Inverse of (1), by Newton's method."""
    wanted, sign = _codes(xyz, at)
    codes = wanted
    for _ in range(NEWTON_STEPS):
        error, slope = _error(codes, p)
        step = (wanted - codes - error) / (1.0 + slope)
        codes = codes + step
        if not np.nanmax(np.abs(step), initial=0.0) > DONE * np.nanmax(np.abs(codes), initial=0.0):
            break
    return tuple(sign * codes)


def jacobian(xyz, p, at: Conditions):
    """Slopes of (1)."""
    codes, sign = _codes(xyz, at)
    d_p = np.zeros((3, len(p), codes.shape[1]))
    by_period = np.zeros(codes.shape)
    for h in range((len(p) - 1) // 6):
        turn = 2.0 * np.pi * (h + 1) / p[-1]
        sine, cosine = np.sin(turn * codes), np.cos(turn * codes)
        for axis in range(3):
            d_p[axis, 6 * h + axis], d_p[axis, 6 * h + 3 + axis] = sine[axis], cosine[axis]
            slope = p[6 * h + axis] * cosine[axis] - p[6 * h + 3 + axis] * sine[axis]
            by_period[axis] -= turn / p[-1] * codes[axis] * slope
    if (len(p) - 1) % 6:
        for axis in range(3):
            d_p[axis, -4 + axis] = codes[axis] ** 2
    d_p[:, -1] = by_period
    return 1.0 + _error(codes, p)[1], sign * d_p


def shapes(setup: Setup):
    """The bow, and the ripple where the model file says its period."""
    bow = Shape(settings={"bow": True, "harmonics": 0})
    return (Shape(), bow) if "period_lsb" in setup.settings else (bow,)


def search(setup: Setup, at: Conditions, reading: Array, residual: Array):
    """The period at which the residual (3, n) repeats over the reading: plain, and with corners."""
    codes, sign = _codes(reading, at)
    f, tried = scan.line(codes, sign * residual, FINEST_LSB)
    if not tried:
        return ()
    found = {"period_lsb": 1.0 / f}
    inner = {"period": 1.0 / f}
    return tuple(Shape(inner=inner, settings=found | {"harmonics": h}, tried=tried) for h in (1, 3))


ADC_INL = Effect(
    "adc_inl",
    "y = c + sum (s_h sin(2 pi h c / P) + c_h cos(2 pi h c / P)) + q c^2",
    "IEEE Std 1241; thesis 6.2.2.1 (nonlinearity of the converters)",
    params,
    forward,
    undo,
    jacobian,
    summary="the converter's codes are unevenly spaced",
    stage="reading",
    off_board="its undo needs sines",
    shapes=shapes,
    search=search,
)
