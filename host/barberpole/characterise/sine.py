"""Amplitude of a sine in a reading: by fitting the sine, and by its histogram (article 2.4, eq. 8-9, fig. 3).

    P_S(y) = 1 / (pi sqrt(A² - y²))                     density of a sine of amplitude A          (8)
    P_G(x) = exp(-x² / 2 sigma²) / (sqrt(2 pi) sigma)   density of the noise                      (9)

What a reading shows is their convolution, here over bins of the histogram and with the sine's phase as the variable of
integration, in which (8) has no poles:  P(y) = 1/pi int_0^pi P_G(y - c - A cos t) dt. The histogram needs no phase and
no time: it serves where the sampling is too slow or too noisy for the sine itself. Readings in any unit.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.special import ndtr

from barberpole.errors import InputError, must

PHASES = 256  # points of the integral over half a period
BINS = 60  # of readings that are not whole numbers
LEAST_ROWS = 100
SCAN = 12  # half lines either way that the frequency may be off: 6 periods over the record
REFINEMENTS = 6  # of the frequency, each Gauss-Newton
SEEN = 1e-3  # relative size of noise without which a histogram of (8) has no width


@dataclass(frozen=True)
class Sine:
    """offset + amplitude cos(2 pi f t + phase): amplitude >= 0 with standard error, rms of what is left."""

    amplitude: float
    stderr: float
    frequency_hz: float
    phase_rad: float
    offset: float
    rms: float


@dataclass(frozen=True)
class Histogram:
    """Amplitude A and centre c of (8)-(9) with A's standard error; the bins' edges (k + 1,), counts and fit (k,)."""

    amplitude: float
    stderr: float
    centre: float
    sigma: float
    edges: np.ndarray
    counts: np.ndarray
    expected: np.ndarray


def fit_sine(t_s: np.ndarray, y: np.ndarray, frequency_hz: float) -> Sine:
    """Sine of about this frequency through y (n,) at t_s (n,), the frequency refined.

    Raises InputError with fewer than LEAST_ROWS rows, or less than one period.
    """
    if len(y) < LEAST_ROWS or (t_s[-1] - t_s[0]) * frequency_hz < 1.0:
        got = f"{len(y)} rows over {(t_s[-1] - t_s[0]) * frequency_hz:.2g} periods"
        raise InputError(must("a sine fit", f"given at least {LEAST_ROWS} rows and one period", got))
    t = t_s - t_s.mean()
    f = _nearest(t, y, float(frequency_hz))
    for _ in range(REFINEMENTS):
        solved, covariance, left = _linear(t, y, f, with_slope=True)
        a, b, _, slope = solved
        shift = slope / (2.0 * np.pi * max(a * a + b * b, 1e-300))
        f += float(np.clip(shift, -0.5 / np.ptp(t), 0.5 / np.ptp(t)))
    solved, covariance, left = _linear(t, y, f, with_slope=False)
    a, b, offset = solved
    size = float(np.hypot(a, b))
    along = np.array([a, b]) / max(size, 1e-300)
    stderr = float(np.sqrt(along @ covariance[:2, :2] @ along))
    phase = float(np.arctan2(-b, a) - 2.0 * np.pi * f * t_s.mean())
    return Sine(size, stderr, f, phase, float(offset), float(np.sqrt(np.mean(left**2))))


def _nearest(t: np.ndarray, y: np.ndarray, f: float) -> float:
    """The frequency within SCAN lines of 1/T of f that holds most power, in half lines."""
    trials = f + np.arange(-SCAN, SCAN + 1) / (2.0 * np.ptp(t))
    about = y - y.mean()
    power = [np.abs(np.exp(-2j * np.pi * trial * t) @ about) for trial in trials]
    return float(trials[int(np.argmax(power))])


def _linear(t: np.ndarray, y: np.ndarray, f: float, with_slope: bool):
    """a cos + b sin + c (+ d times the derivative by 2 pi f): coefficients, covariance, residual."""
    columns = [np.cos(2 * np.pi * f * t), np.sin(2 * np.pi * f * t), np.ones_like(t)]
    if with_slope:
        a, b = np.linalg.lstsq(np.stack(columns).T, y, rcond=None)[0][:2]
        quadrature = t * (b * columns[0] - a * columns[1])
        columns.append(quadrature / max(float(np.hypot(a, b)) ** 2, 1e-300))
    stacked = np.stack(columns)
    gram = stacked @ stacked.T
    solved = np.linalg.solve(gram, stacked @ y)
    left = y - solved @ stacked
    variance = float(left @ left) / max(len(y) - len(columns), 1)
    return solved, variance * np.linalg.inv(gram), left


def bin_probability(edges: np.ndarray, amplitude: float, centre: float, sigma: float) -> np.ndarray:
    """Probability (k,) of bins with edges (k + 1,) under (8) convolved with (9)."""
    phase = np.pi * (np.arange(PHASES) + 0.5) / PHASES
    below = ndtr((edges[:, None] - centre - amplitude * np.cos(phase)) / sigma).mean(axis=1)
    return np.diff(below)


def fit_histogram(y: np.ndarray, sigma: float) -> Histogram:
    """A and c from the histogram of y (n,), by least squares of counts; sigma is the noise at zero field.

    The bins are the counts of the converter where y are whole numbers. Raises InputError where there is no sine to see.
    """
    if len(y) < LEAST_ROWS or not np.ptp(y) > 0:
        raise InputError(must("a histogram fit", f"given at least {LEAST_ROWS} rows that move", f"{len(y)} rows"))
    edges = _edges(y)
    counts = np.histogram(y, edges)[0].astype(float)
    width = max(sigma, SEEN * float(np.ptp(y)))

    def difference(p: np.ndarray) -> np.ndarray:
        return (len(y) * bin_probability(edges, p[0], p[1], width) - counts) / np.sqrt(np.maximum(counts, 1.0).mean())

    start = np.array([np.sqrt(2.0) * np.sqrt(max(y.var() - sigma**2, (0.05 * np.ptp(y)) ** 2)), y.mean()])
    found = least_squares(difference, start, x_scale=np.array([start[0], start[0]]))
    variance = 2.0 * found.cost / max(len(counts) - 2, 1)
    covariance = variance * np.linalg.inv(found.jac.T @ found.jac)
    amplitude, centre = float(abs(found.x[0])), float(found.x[1])
    expected = len(y) * bin_probability(edges, amplitude, centre, width)
    return Histogram(amplitude, float(np.sqrt(covariance[0, 0])), centre, float(width), edges, counts, expected)


def _edges(y: np.ndarray) -> np.ndarray:
    """Edges of bins: one count wide (or a whole number of them) for whole numbers, else BINS over the range."""
    low, high = float(y.min()), float(y.max())
    if np.all(y == np.round(y)):
        step = max(1.0, np.ceil((high - low + 1) / (2 * BINS)))
        return np.arange(low - 0.5 - 2 * step, high + 0.5 + 3 * step, step)
    margin = 0.1 * (high - low)
    return np.linspace(low - margin, high + margin, BINS + 1)
