"""Whether RESET readings came raw, with the sign that the reversed magnetisation gives them, or already turned back.

A raw bridge reads s (G f + b) + o with s = +1 after SET and -1 after RESET; field f, gain G, bias b and the bridge's
own offset o. So what varies with the field has opposite signs in raw SET and RESET readings, and o has the same.
"""

import numpy as np

CLEAR = 0.3  # correlation that no noise makes; with few pairs CLEAR_SIGMA standard errors of it
CLEAR_SIGMA = 4.0


def pairs_are_raw(set_lsb: np.ndarray, reset_lsb: np.ndarray) -> bool:
    """Decide from SET and RESET readings (3, m) of nearly the same field, in LSB.

    By how the two vary together; where the field stands still, by the signs of their means.
    """
    m = set_lsb.shape[1]
    a, b = set_lsb - set_lsb.mean(axis=1, keepdims=True), reset_lsb - reset_lsb.mean(axis=1, keepdims=True)
    size = np.sqrt(np.sum(a * a) * np.sum(b * b))
    correlation = float(np.sum(a * b) / size) if size > 0 else 0.0
    if m > 2 and abs(correlation) > max(CLEAR, CLEAR_SIGMA / np.sqrt(3 * m)):
        return correlation < 0
    return float(np.sum(set_lsb.mean(axis=1) * reset_lsb.mean(axis=1))) < 0


def states_are_raw(reading_lsb: np.ndarray, state: np.ndarray, b_ut: np.ndarray | None) -> bool:
    """Decide from readings (3, n) of one magnetisation each, state (n,) ±1, and the field (3, n) in µT where known.

    With a known field by the slope against it in either state; else by the readings on both sides of each flip.
    """
    if b_ut is not None and (slopes := _slope(reading_lsb, b_ut, state > 0)) is not None:
        opposite = _slope(reading_lsb, b_ut, state < 0)
        if opposite is not None:
            return float(np.sum(slopes * opposite)) < 0
    flips = np.flatnonzero(state[:-1] * state[1:] < 0)
    before, after = reading_lsb[:, flips], reading_lsb[:, flips + 1]
    first_is_set = state[flips] > 0
    return pairs_are_raw(np.where(first_is_set, before, after), np.where(first_is_set, after, before))


def _slope(reading: np.ndarray, field: np.ndarray, rows: np.ndarray) -> np.ndarray | None:
    """Covariance (3, 3) of reading and field over some rows, None where the field hardly moves there."""
    if rows.sum() < 3:
        return None
    y = reading[:, rows] - reading[:, rows].mean(axis=1, keepdims=True)
    b = field[:, rows] - field[:, rows].mean(axis=1, keepdims=True)
    return y @ b.T if np.any(b) else None
