"""The noise of the sensor from a stretch of the log in which it lay still, and from records at another rate."""

import numpy as np

from barberpole.fit.noise import Noise, estimate
from barberpole.observations import Observations

BLOCK = 20  # samples whose medians are compared
LEAST = 400  # samples at rest: fewer do not show the colour
MOVED = 4.0  # standard deviations of the noise from one block's median to the next
SAME_RATE = 0.05  # relative difference of two sampling rates that is none
QUIETEST = 0.1  # of the blocks
WANDERED = 8.0  # the same from the lowest to the highest: 1/f noise wanders this far
MAD = 1.4826  # of a normal distribution: standard deviation over median absolute deviation


def noise_of(rest: Observations, seen: Observations, background: Noise) -> Noise:
    """Noise of a record at rest, as a log has it. background: of the log's own residual, which gives its white level
    where its rate is another."""
    own, other, found = interval(rest), interval(seen), estimate(rest.y, "rest")
    if not own or not other or abs(own / other - 1.0) < SAME_RATE:
        return found
    return found.at_rate(own / other, float(np.mean(background.white)) / float(np.mean(found.white)))


def interval(seen: Observations) -> float:
    """Mean seconds from one reading to the next; 0 where the log does not say."""
    t_s = seen.at.t_s
    return 0.0 if t_s is None else float(t_s[-1] - t_s[0]) / max(seen.y.shape[1] - 1, 1)


def noise_within(seen: Observations) -> Noise | None:
    """Noise of the longest stretch of a log in which nothing moved; None if there is none of LEAST samples."""
    rows = longest_rest(seen.y, np.broadcast_to(np.asarray(seen.at.state, float), seen.y.shape[1:]))
    if rows is None:
        return None
    y, at = seen.y[:, rows], seen.at.take(rows)
    state = np.broadcast_to(np.asarray(at.state, float), y.shape[1:])
    return estimate(_level(y, state), "still")


def longest_rest(y: np.ndarray, state: np.ndarray) -> slice | None:
    """The longest run of samples that stays on one level, SET and RESET each on its own."""
    count = y.shape[1] // BLOCK
    if count * BLOCK < LEAST:
        return None
    medians = _medians(y, state, count) / np.maximum(_noise(y, count), 1e-300)[:, None, None]
    best, start = (0, 0), 0
    for block in range(1, count + 1):
        if block == count or not _same_level(medians[:, :, start : block + 1]):
            best = max(best, (block - start, start))
            start = block
    length, start = best
    return slice(start * BLOCK, (start + length) * BLOCK) if length * BLOCK >= LEAST else None


def _noise(y: np.ndarray, count: int) -> np.ndarray:
    """(3,) standard deviation in the quietest blocks; every other sample, as SET and RESET may come in turns."""
    apart = np.abs(y[:, 2:] - y[:, :-2])[:, : (count - 1) * BLOCK].reshape(len(y), count - 1, BLOCK)
    return np.quantile(MAD * np.median(apart, axis=2) / np.sqrt(2.0), QUIETEST, axis=1)


def _medians(y: np.ndarray, state: np.ndarray, count: int) -> np.ndarray:
    """(3, states, blocks), NaN where a block holds no sample of a state."""
    kinds = np.unique(state)
    out = np.full((len(y), kinds.size, count), np.nan)
    for block in range(count):
        rows = slice(block * BLOCK, (block + 1) * BLOCK)
        for at, kind in enumerate(kinds):
            own = state[rows] == kind
            if own.any():
                out[:, at, block] = np.median(y[:, rows][:, own], axis=1)
    return out


def _same_level(medians: np.ndarray) -> bool:
    """Whether the last block goes on where those before it were."""
    missing = np.isnan(medians)
    spread = np.where(missing, -np.inf, medians).max(axis=2) - np.where(missing, np.inf, medians).min(axis=2)
    step = np.abs(medians[:, :, -1] - medians[:, :, -2])
    return not (np.any(spread > WANDERED) or np.any(step > MOVED))


def _level(y: np.ndarray, state: np.ndarray) -> np.ndarray:
    """Readings less the mean of their state."""
    out = y.copy()
    for kind in np.unique(state):
        own = state == kind
        out[:, own] -= out[:, own].mean(axis=1, keepdims=True)
    return out
