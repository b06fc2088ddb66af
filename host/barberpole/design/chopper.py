"""Flipping as chopper stabilisation (thesis 3.4.3, fig. 3.13): the signal goes to the flip rate, flicker stays below.

    b signal -> c modulated by SET and RESET -> d with the amplifier's noise -> e demodulated -> f low-passed

The amplifier's noise has the one-sided density n^2 (1 + f_c / f) with the corner f_c. Demodulated with a square wave at
the rate f_0 it becomes, from the odd harmonics m of that wave (4 / (pi m)^2 of the power on either side),

    S(f) = sum over odd m > 0 of (2 / (pi m))^2 [S_n(m f_0 - f) + S_n(m f_0 + f)]                              (1)
    S(0) = n^2 (1 + 7 zeta(3) / pi^2  f_c / f_0)                                                                (2)

so 1/f becomes white, and lower the faster one flips.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import zeta

Array = np.ndarray

FLICKER_LEFT = 7.0 * zeta(3) / np.pi**2  # of f_c / f_0 in eq. (2)
HARMONICS = 201  # of eq. (1); what is left out falls with the cube of the last flicker term
FILTER_ORDER = 4  # of the low pass behind the demodulator


@dataclass(frozen=True)
class Chain:
    """A field, its flip rate and the amplifier's noise referred to the field."""

    flip_hz: float
    signal_hz: float
    signal_nt: float
    white_nt_per_rthz: float
    corner_hz: float
    samples_per_cycle: int = 32

    @property
    def sample_hz(self) -> float:
        return self.flip_hz * self.samples_per_cycle


@dataclass(frozen=True)
class Stages:
    """Each stage of fig. 3.13 over time, (n,) nT, sampled at `sample_hz`."""

    sample_hz: float
    signal: Array
    modulated: Array
    amplified: Array
    demodulated: Array
    filtered: Array


def simulate(chain: Chain, seconds: float, cutoff_hz: float, seed: int = 0) -> Stages:
    """The chain over a time in s, with a low pass at `cutoff_hz` at its end."""
    from scipy import signal  # here: it is slow to load, and the choice of a rate does not need it

    count = round(seconds * chain.flip_hz) * chain.samples_per_cycle
    time_s = np.arange(count) / chain.sample_hz
    field = chain.signal_nt * np.sin(2 * np.pi * chain.signal_hz * time_s)
    carrier = np.where(np.arange(count) % chain.samples_per_cycle < chain.samples_per_cycle / 2, 1.0, -1.0)
    amplified = field * carrier + flicker(count, chain, np.random.default_rng(seed))
    demodulated = amplified * carrier
    low_pass = signal.butter(FILTER_ORDER, cutoff_hz, fs=chain.sample_hz, output="sos")
    filtered = signal.sosfilt(low_pass, demodulated)
    return Stages(chain.sample_hz, field, field * carrier, amplified, demodulated, np.asarray(filtered))


def flicker(count: int, chain: Chain, rng: np.random.Generator) -> Array:
    """The amplifier's noise, (count,) nT: white noise shaped to n^2 (1 + f_c / f), without its mean."""
    density = chain.white_nt_per_rthz * np.sqrt(0.5 * chain.sample_hz)
    spectrum = np.fft.rfft(density * rng.standard_normal(count))
    frequency_hz = np.fft.rfftfreq(count, 1.0 / chain.sample_hz)
    spectrum[0] = 0.0
    spectrum[1:] *= np.sqrt(1.0 + chain.corner_hz / frequency_hz[1:])
    return np.fft.irfft(spectrum, count)


def density(values_nt: Array, sample_hz: float, resolution_hz: float) -> tuple[Array, Array]:
    """Frequencies in Hz and density in nT/sqrt(Hz) of a stage, by Welch's method."""
    from scipy import signal

    length = min(len(values_nt), round(sample_hz / resolution_hz))
    frequency_hz, power = signal.welch(values_nt, sample_hz, nperseg=length)
    return frequency_hz, np.sqrt(power)


def unflipped_factor(frequency_hz: Array | float, corner_hz: float) -> Array | float:
    """Density over the white one without flipping: sqrt(1 + f_c / f)."""
    return np.sqrt(1.0 + corner_hz / np.asarray(frequency_hz))


def flipped_factor(frequency_hz: float, flip_hz: float, corner_hz: float) -> float:
    """Density over the white one after demodulation, eq. (1), for a frequency below the flip rate."""
    m = np.arange(1, 2 * HARMONICS, 2)
    flicker_part = corner_hz / (m * flip_hz - frequency_hz) + corner_hz / (m * flip_hz + frequency_hz)
    return float(np.sqrt(1.0 + np.sum((2.0 / (np.pi * m)) ** 2 * flicker_part)))


def residual_factor(flip_hz: float, corner_hz: float) -> float:
    """Density over the white one far below the flip rate, eq. (2)."""
    return float(np.sqrt(1.0 + FLICKER_LEFT * corner_hz / flip_hz))
