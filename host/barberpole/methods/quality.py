"""How well a published method does on its log: the figures that every fit gives.

Residuals are fields in µT, since the methods answer with fields; in LSB they are what the readings would have to move
by: through the linear part for a known field, along the normal of the surface where only |B| = K is known. The gain
along the normal, |L^T n|, is taken as its mean over all directions n, sqrt(tr(L^T L) / 3).
"""

from dataclasses import dataclass

import numpy as np

FOLDS = 5
RUNS = 50  # pieces of a log, so that a fold is a stretch and not every fifth row


@dataclass(frozen=True)
class Quality:
    """RMS residuals; rms_ut None where no field is known, rms_norm_percent None where more than |B| is."""

    rms_lsb: float
    heldout_rms_lsb: float
    rms_ut: float | None = None
    rms_norm_percent: float | None = None


def against_field(left_ut: np.ndarray, heldout_ut: np.ndarray, matrix: np.ndarray) -> Quality:
    """From residuals (3, n) in µT, and the same of stretches left out; matrix (3, 3) in µT/LSB."""
    return Quality(rms(np.linalg.solve(matrix, left_ut)), rms(np.linalg.solve(matrix, heldout_ut)), rms(left_ut))


def of_the_norm(left_ut: np.ndarray, heldout_ut: np.ndarray, upper: np.ndarray, known_ut: float) -> Quality:
    """From |H| - K (n,) in µT, and the same of stretches left out; L (3, 3) in µT/LSB and K in µT."""
    steep = float(np.sqrt(np.sum(upper**2) / 3.0))
    return Quality(rms(left_ut) / steep, rms(heldout_ut) / steep, rms(left_ut), 100.0 * rms(left_ut) / known_ut)


def stretches(n: int) -> np.ndarray:
    """Fold (n,) of each of n rows: neighbours lie in one fold."""
    return np.arange(n) * min(RUNS, n) // n % FOLDS


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
