"""ADC integral nonlinearity: the converter's code is off by an amount that depends on the code alone.

    y = c + k |c| + q c^2 + r c^3                                        form "smooth"   (1)
    y = c + sum_h (s_h sin(2 pi h c / P) + u_h cos(2 pi h c / P))        form "ripple"   (2)

(1) bends the transfer curve: a kink at mid scale, a bow, a curve. (2) is a lower bit of the wrong weight, which
repeats every P codes, P a power of two (settings `period_lsb`, `harmonics`). c is the raw code: where RESET readings
were brought to the sign of SET, the law acts on s c and the result is turned back, so that kink and bow alternate. In
demodulated readings they cancel but for what the offset makes of them, and the rest of (1) looks like `quadratic` and
`cubic` unless the code sits far from the field's zero.
"""

import numpy as np

from barberpole.effects import scan
from barberpole.effects.codes import error, terms
from barberpole.effects.effect import Array, Conditions, Effect, Param, Setup, Shape, per_axis
from barberpole.errors import InputError, must

MAX_HARMONICS = 5
PERIOD_LSB = 64.0
MONOTONIC = 0.15  # of its period: a ripple of a larger amplitude than 1/(2 pi) would turn codes around
EXACT = 1e-4  # how far a fit may move the period: a power of two is one
NEWTON_STEPS = 30
DONE = 1e-13


def params(setup: Setup):
    """Smooth: k, q in 1/LSB, r in 1/LSB². Ripple: amplitudes in LSB and the period in LSB."""
    if setup.named("form", "smooth", "ripple") == "ripple":
        return _ripple(setup)
    span, part = setup.span_ut * setup.lsb_per_ut, 0.005
    kinds = (("kink_", "1", 1.0), ("bow_", "1/LSB", span), ("curve_", "1/LSB^2", span * span))
    sized = [(p, unit, {"typical": part / s, "lower": -0.1 / s, "upper": 0.1 / s}) for p, unit, s in kinds]
    return tuple(param for prefix, unit, size in sized for param in per_axis(unit, prefix=prefix, **size))


def _ripple(setup: Setup):
    harmonics, period = setup.settings.get("harmonics", 1), float(setup.settings.get("period_lsb", PERIOD_LSB))
    if not isinstance(harmonics, int) or not 1 <= harmonics <= MAX_HARMONICS:
        raise InputError(must("setting harmonics", f"a whole number from 1 to {MAX_HARMONICS}", repr(harmonics)))
    found = []
    for h in range(1, harmonics + 1):
        size = {"typical": 0.01 * period / h, "lower": -MONOTONIC * period / h, "upper": MONOTONIC * period / h}
        found += [*per_axis("LSB", prefix=f"sin{h}_", **size), *per_axis("LSB", prefix=f"cos{h}_", **size)]
    low, high = period * (1.0 - EXACT), period * (1.0 + EXACT)
    return *found, Param("period", "LSB", period, low, high, None, period, inner=True)


def _codes(xyz, at: Conditions):
    """Raw codes (3, n) and the sign that makes them; a demodulated reading has none of its own."""
    sign = np.where(np.asarray(at.state) < 0, -1.0, 1.0) if at.raw_polarity else 1.0
    return sign * np.asarray(xyz), sign


def forward(xyz, p, at: Conditions):
    """Eq. (1) or (2), LSB."""
    codes, sign = _codes(xyz, at)
    return tuple(np.asarray(xyz) + sign * error(codes, p)[0])


def undo(xyz, p, at: Conditions):
    """Inverse by Newton's method."""
    wanted, sign = _codes(xyz, at)
    codes = wanted
    for _ in range(NEWTON_STEPS):
        wrong, slope = error(codes, p)
        step = (wanted - codes - wrong) / (1.0 + slope)
        codes = codes + step
        if not np.nanmax(np.abs(step), initial=0.0) > DONE * np.nanmax(np.abs(codes), initial=0.0):
            break
    return tuple(sign * codes)


def joint(xyz, p, at: Conditions):
    """(1) or (2) and its slopes."""
    codes, sign = _codes(xyz, at)
    parts = terms(codes, p)
    wrong, slope = error(codes, p, parts)
    by_group = np.concatenate([value for value, _ in parts])
    if len(p) == 9:
        return np.asarray(xyz) + sign * wrong, 1.0 + slope, sign * by_group
    d_p = np.zeros((3, len(p), codes.shape[1]))
    for axis in range(3):
        d_p[axis, axis:-1:3] = by_group[axis::3]
        d_p[axis, -1] = -slope[axis] * codes[axis] / p[-1]
    return np.asarray(xyz) + sign * wrong, 1.0 + slope, sign * d_p


def shapes(setup: Setup):
    """Kink, bow and curve each for itself, and together."""
    smooth = {"form": "smooth"}
    single = [Shape(tuple(kind + axis for axis in "xyz"), settings=smooth) for kind in ("kink_", "bow_", "curve_")]
    return *single, Shape(settings=smooth)


def search(setup: Setup, at: Conditions, reading: Array, residual: Array):
    """The power of two at which the residual (3, n) repeats over the codes best: plain, and with corners."""
    codes, sign = _codes(reading, at)
    period, tried = scan.power_of_two(codes, sign * residual)
    if not tried:
        return ()
    ripple = {"form": "ripple", "period_lsb": period}
    inner = {"period": period}
    return tuple(Shape(inner=inner, settings=ripple | {"harmonics": h}, tried=tried) for h in (1, 3))


ADC_INL = Effect(
    "adc_inl",
    "y = c + k |c| + q c^2 + r c^3, or c + sum (s_h sin(2 pi h c / P) + u_h cos(2 pi h c / P))",
    "IEEE Std 1241; thesis 6.2.2.1 (nonlinearity of the converters)",
    params,
    forward,
    undo,
    joint=joint,
    summary="the converter's codes are unevenly spaced",
    stage="reading",
    off_board="it acts on single codes, of which the board undoes the mean",
    shapes=shapes,
    search=search,
    settings=("form", "harmonics", "period_lsb"),
)
