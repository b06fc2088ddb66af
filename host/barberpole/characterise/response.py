"""Frequency response: amplitude over that at the lowest frequency (article 2.4, 3.1, fig. 6)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from barberpole.errors import InputError, must

HALF_POWER = 1.0 / np.sqrt(2.0)


@dataclass(frozen=True)
class Response:
    """frequency_hz (k,); relative (k,) mean over channels of the amplitude over that at the first frequency.

    stderr (k,) of that mean, from the channels' scatter; channels (m, k) one sensor's axis each.
    """

    frequency_hz: np.ndarray
    relative: np.ndarray
    stderr: np.ndarray
    channels: np.ndarray


def response(frequency_hz: Sequence[float], amplitude: np.ndarray) -> Response:
    """From amplitudes (m channels, k frequencies), of all axes of one sensor or of several sensors of a kind.

    Raises InputError with fewer than two frequencies.
    """
    f = np.asarray(frequency_hz, float)
    order = np.argsort(f)
    if len(np.unique(f)) < 2:
        raise InputError(must("a frequency response", "made of at least two frequencies", f"{len(np.unique(f))}"))
    channels = amplitude[:, order] / amplitude[:, order[:1]]
    count = channels.shape[0]
    spread = channels.std(axis=0, ddof=1) / np.sqrt(count) if count > 1 else np.full(len(f), np.nan)
    return Response(f[order], channels.mean(axis=0), spread, channels)


def first_order(frequency_hz: np.ndarray | float, bandwidth_hz: float) -> np.ndarray:
    """Amplitude of a first-order low-pass of this 3 dB bandwidth, 1 at 0 Hz."""
    return 1.0 / np.sqrt(1.0 + (np.asarray(frequency_hz) / bandwidth_hz) ** 2)


def bandwidth_hz(frequency_hz: float, relative: float) -> float:
    """3 dB bandwidth of the first-order low-pass of this relative amplitude at this frequency; inf for 1 and more."""
    return float(frequency_hz / np.sqrt(1.0 / relative**2 - 1.0)) if relative < 1.0 else float("inf")
