"""Where a residual is periodic: in time, or over a converter's codes.

The residual is averaged over bins of the variable and Fourier transformed; a line counts by its height over the
smoothed spectrum around it, so that slow structure and 1/f noise do not pass for a line.
"""

import numpy as np

from barberpole.effects.effect import Array

MAX_BINS = 1 << 17
SMOOTH = 31  # spectral bins of the background
POWERS = 12  # up to 8192 codes
SLOWEST = 4  # periods over the range: anything slower is drift or curvature


def line(variable: Array, residual: Array, step: float) -> tuple[float, int]:
    """Frequency (1 / unit of `variable`) of the strongest line of residual (m, n) over variable (m, n) or (n,).

    `step` is the finest spacing that means anything. Also returns how many frequencies were looked through; 0 where
    the range holds too few periods.
    """
    low, high = float(np.min(variable)), float(np.max(variable))
    bins = int(min(MAX_BINS, np.ceil((high - low) / step) + 1)) if high > low else 0
    if bins < 4 * SLOWEST:
        return 0.0, 0
    width = (high - low) / (bins - 1)
    power = 0.0
    for values, rest in zip(np.broadcast_to(variable, residual.shape), residual, strict=True):
        place = np.rint((values - low) / width).astype(int)
        power = power + np.abs(np.fft.rfft(np.bincount(place, rest - rest.mean(), bins), 2 * bins)) ** 2
    prominence = np.asarray(power) / _background(np.asarray(power))
    prominence[: 2 * SLOWEST] = 0.0
    best = int(np.argmax(prominence))
    start = best / (2 * bins * width)
    return _refine(variable, residual, start, 0.5 / (bins * width)), min(bins, residual.shape[1])


def power_of_two(codes: Array, residual: Array) -> tuple[float, int]:
    """The power of two, in the unit of `codes` (m, n), at which residual (m, n) repeats best, and how many were tried.

    Of at least four, so that a code and the next differ, and of three periods over the range.
    """
    most = float(np.ptp(codes)) / 3.0
    periods = [4.0 * 2.0**k for k in range(POWERS) if 4.0 * 2.0**k <= most]
    if not periods:
        return 0.0, 0
    return max(periods, key=lambda period: power(codes, residual, 1.0 / period)), len(periods)


def _background(power: Array) -> Array:
    edge = np.pad(power, SMOOTH // 2, mode="reflect")
    total = np.convolve(edge, np.ones(SMOOTH) / SMOOTH, mode="valid")
    return np.maximum(total, 1e-300)


def _refine(variable: Array, residual: Array, start: float, reach: float) -> float:
    """The exact maximum of the periodogram within `reach` of `start`, by successive parabolas."""
    centre, half = start, reach
    for _ in range(6):
        around = centre + half * np.array([-1.0, 0.0, 1.0])
        a, b, c = (power(variable, residual, f) for f in around)
        bend = a - 2.0 * b + c
        centre += half * np.clip(0.5 * (a - c) / bend, -1.0, 1.0) if bend < 0 else half * np.sign(c - a)
        half *= 0.4
    return float(centre)


def power(variable: Array, residual: Array, frequency: float) -> float:
    """Periodogram of residual (m, n) over variable (n,) or (m, n) at one frequency, summed over the rows."""
    wave = np.exp(2j * np.pi * frequency * variable)
    return float(np.sum(np.abs(np.sum(residual * wave, axis=-1)) ** 2))
