"""Sensor noise: white plus 1/f, drawn by shaping a spectrum."""

import numpy as np


def draw(n: int, sigma: float, corner: float, rng: np.random.Generator) -> np.ndarray:
    """(3, n) of RMS sigma on average, density proportional to 1 + corner/f, both in cycles a sample."""
    if corner == 0.0:
        return sigma * rng.normal(size=(3, n))
    long = 4 * n  # a stretch out of a longer record: slower swings than the record itself are in it
    f = np.fft.rfftfreq(long)
    f[0] = f[1]
    spectrum = np.fft.rfft(rng.normal(size=(3, long)), axis=1) * np.sqrt(1.0 + corner / f)
    spectrum[:, 0] = 0.0
    series = np.fft.irfft(spectrum, long, axis=1)[:, :n]
    return sigma * series / np.sqrt(np.mean(1.0 + corner / f))
