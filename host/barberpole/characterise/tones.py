"""Amplitude against frequency from logs of an applied sine (article 2.4, fig. 6)."""

import numpy as np

from barberpole.characterise.kinds import FREQUENCY, Sorted
from barberpole.characterise.response import Response, response
from barberpole.characterise.sine import LEAST_ROWS, fit_histogram, fit_sine
from barberpole.errors import InputError, must
from barberpole.log import Log

LEAST_AMPLITUDE = 2.0  # in standard deviations of the noise: an axis with less does not see the sine
FIELD = ("bx_ut", "by_ut", "bz_ut")


def amplitudes(of: Sorted, sigma_lsb: np.ndarray | None) -> Response | None:
    """Relative amplitudes of all axes that see the sine, from the histogram; None without two frequencies.

    sigma_lsb (3,) is the noise at rest; without it the rms beside the sine of the slowest log stands for it.
    Where a log carries the applied field, amplitudes are per µT of it.
    """
    stretches = sorted((s for log in of.sine for s in _stretches(of, log)), key=lambda s: s[0])
    if len({round(f, 6) for f, *_ in stretches}) < 2:
        return None
    if sigma_lsb is None:
        f, t, y, _ = stretches[0]
        sigma_lsb = np.array([fit_sine(t, axis, f).rms for axis in y])
    table = np.array([[_relative(y[i], sigma_lsb[i], drive) for _, _, y, drive in stretches] for i in range(3)])
    size = np.array([fit_histogram(stretches[0][2][i], sigma_lsb[i]).amplitude for i in range(3)])
    seen = size > LEAST_AMPLITUDE * sigma_lsb
    if not seen.any():
        got = f"{np.max(size / sigma_lsb):.2g} times the noise"
        raise InputError(must("the sine", f"seen by an axis with {LEAST_AMPLITUDE:g} times its noise", got))
    return response([f for f, *_ in stretches], table[seen])


def _relative(y: np.ndarray, sigma: float, drive: float) -> float:
    return fit_histogram(y, float(sigma)).amplitude / drive


def _stretches(of: Sorted, log: Log) -> list[tuple[float, np.ndarray, np.ndarray, float]]:
    """(frequency, t, readings, applied amplitude or 1) of each stretch of one frequency."""
    t, y, field = log["t_s"], of.readings(log), log.stack(FIELD)
    if not log.has(FREQUENCY):
        frequency, drive = _of_field(t, field)
        return [(frequency, t, y, drive)]
    out = []
    for f in np.unique(log[FREQUENCY]):
        rows = log[FREQUENCY] == f
        if f > 0 and rows.sum() >= LEAST_ROWS:
            drive = 1.0 if field is None else fit_sine(t[rows], _along(field[:, rows]), float(f)).amplitude
            out.append((float(f), t[rows], y[:, rows], drive))
    return out


def _along(field: np.ndarray) -> np.ndarray:
    """Component (n,) of a field (3, n) along the direction in which it varies most."""
    about = field - field.mean(axis=1, keepdims=True)
    return np.linalg.svd(about @ about.T)[0][:, 0] @ about


def _of_field(t: np.ndarray, field: np.ndarray | None) -> tuple[float, float]:
    """Frequency and amplitude of the applied field itself."""
    if field is None:
        raise InputError(must("a sine log", f"given {FREQUENCY} or the applied field", "neither"))
    along = _along(field)
    power = np.abs(np.fft.rfft(along))
    line = int(np.argmax(power[1:])) + 1
    fitted = fit_sine(t, along, line / (len(t) * float(np.mean(np.diff(t)))))
    return fitted.frequency_hz, fitted.amplitude
