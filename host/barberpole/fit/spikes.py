"""Readings that stand alone: far from the one before and the one after, on the same side of both."""

import numpy as np

from barberpole.errors import must
from barberpole.fit.ellipsoid import coverage_message

ALONE = 20.0  # robust deviations of the same measure over the log
MAD = 1.4826
FEW = 0.05  # of the rows: more are no spikes
NO_SPIKES = "free of spikes (take those rows out, or fit with the effect outliers in the model)"


def isolated(y: np.ndarray) -> np.ndarray:
    """Mask (n,) of the rows of readings (3, n) that stand alone; none where more than a few do."""
    out = np.zeros(y.shape[1], bool)
    if y.shape[1] < 3:
        return out
    back, ahead = y[:, 1:-1] - y[:, :-2], y[:, 1:-1] - y[:, 2:]
    apart = np.where(back * ahead > 0.0, np.minimum(np.abs(back), np.abs(ahead)), 0.0)
    usual = np.median(np.maximum(np.abs(back), np.abs(ahead)), axis=1, keepdims=True)
    out[1:-1] = np.any(apart > ALONE * MAD * np.maximum(usual, 1e-9 * np.ptp(y)), axis=0)
    return out if np.mean(out) <= FEW else np.zeros_like(out)


def said_of_spikes(alone: np.ndarray) -> str:
    """What a refusal says of a mask (n,) of spikes."""
    return f"{np.count_nonzero(alone)} of {alone.size} that stand alone, the first in row {int(np.argmax(alone)) + 1}"


def no_surface(y: np.ndarray) -> str:
    """Why readings (3, n) lie on no closed surface: spikes where there are some, else what they do not cover."""
    alone = isolated(y)
    return must("the readings", NO_SPIKES, said_of_spikes(alone)) if alone.any() else coverage_message(y)
