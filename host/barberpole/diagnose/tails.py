"""Residuals that no smooth cause makes: single wrong readings, and jumps from one level to another."""

import numpy as np

LIKELIER = 15.0  # gain in log likelihood that a second, wider population must bring
LIKELIER_COLOURED = 30.0  # the same beside a median of neighbours, which is only nearly normal
CLUMPED = 4.0  # in standard errors: squared residuals this alike from sample to sample are no single outliers
EM_STEPS = 30
LARGE = 9.0  # squared residuals count as this at most where their likeness is judged: giants would make any
GIANT = 12.0  # robust standard deviations
RARE = 0.05  # of all readings may be giants
REACH = 2  # samples on either side that an outlier is held against
STEP = 9  # samples on either side of a possible jump; medians of nine pass over single outliers
STEADY = 0.97  # cosine of the angle that a normal may turn in a step
MAD = 1.4826  # of a normal distribution: standard deviation over median absolute deviation


def wrong_readings(residual: np.ndarray, coloured: bool) -> float:
    """Evidence (log likelihood) for single outliers in residuals (m, n); 0 if they come in clumps."""
    z, apart = (beside_neighbours(residual), 2 * REACH + 1) if coloured else (residual, 1)
    spread = MAD * np.median(np.abs(z), axis=1, keepdims=True)
    square = np.minimum((z / np.maximum(spread, 1e-300)) ** 2, LARGE)
    square -= square.mean(axis=1, keepdims=True)
    alike = np.sum(square[:, apart:] * square[:, :-apart]) / np.sum(square * square) * np.sqrt(square.size)
    return 0.0 if alike > CLUMPED else two_populations((z / np.maximum(spread, 1e-300)).ravel())


def lonely_giants(residual: np.ndarray) -> float:
    """Evidence for single readings far beyond all others in residuals (m, n); 0 if they are many or stand together."""
    z = np.abs(beside_neighbours(residual))
    giant = z > GIANT * MAD * np.median(z, axis=1, keepdims=True)
    together = np.count_nonzero(giant[:, 1:] & giant[:, :-1])
    if np.mean(giant) > RARE or together > 0.2 * np.count_nonzero(giant):
        return 0.0
    return float(np.count_nonzero(giant)) * GIANT**2 / 2.0


def beside_neighbours(residual: np.ndarray) -> np.ndarray:
    """Residuals (m, n) less the median of two on either side: in coloured noise an outlier then stands alone.

    Whitening would smear it over what follows.
    """
    n = residual.shape[1]
    padded = np.pad(residual, ((0, 0), (REACH, REACH)), mode="reflect")
    around = [padded[:, at : at + n] for at in range(2 * REACH + 1) if at != REACH]
    return residual - np.median(around, axis=0)


def jumps(residual: np.ndarray, normal: np.ndarray | None = None) -> np.ndarray:
    """Evidence (m,) for jumps between levels in residuals (m, n), whatever their colour.

    Gaussian noise of any spectrum has Gaussian differences of medians; a signal that rests and jumps has not. A scalar
    residual jumps where its normal (3, n) turns, from the noise of one axis to that of another: only what lies between
    turns counts.
    """
    n = residual.shape[1] // STEP
    if n < 4 * STEP:
        return np.zeros(residual.shape[0])
    change = np.diff(np.median(_in_steps(residual), axis=2), axis=1)
    if normal is not None:
        mean = _in_steps(normal).mean(axis=2)
        change = change[:, np.sum(mean[:, 1:] * mean[:, :-1], axis=0) > STEADY]
        if change.shape[1] < 4 * STEP:
            return np.zeros(residual.shape[0])
    return np.array([two_populations(row) for row in change])


def dither(readings: np.ndarray, channels: int) -> np.ndarray:
    """(channels, n) to add to residuals of readings (3, n), so that a converter's levels are no levels of the signal.

    Evenly spread over one step to either side: what rests within the noise of a step jumps by whole ones. Zeros where
    hardly a reading is there twice.
    """
    step = np.array([_step(axis) for axis in readings])
    step = step if channels == len(step) else np.max(step, keepdims=True)
    return step[:, None] * np.random.default_rng(0).uniform(-1.0, 1.0, (channels, readings.shape[1]))


def _step(readings: np.ndarray) -> float:
    """The least difference of readings (n,) of which most are there more than once; else 0."""
    levels = np.unique(readings)
    return float(np.min(np.diff(levels))) if 1 < levels.size < 0.5 * readings.size else 0.0


def _in_steps(rows: np.ndarray) -> np.ndarray:
    """(m, n) -> (m, n / STEP, STEP)."""
    n = rows.shape[1] // STEP
    return rows[:, : n * STEP].reshape(rows.shape[0], n, STEP)


def two_populations(x: np.ndarray) -> float:
    """Gain in log likelihood of a few values of wider spread among normal ones, over all being alike."""
    x = x - np.median(x)
    plain = -0.5 * x.size * np.log(np.mean(x * x) + 1e-300) - 0.5 * x.size
    narrow, wide, part = (MAD * float(np.median(np.abs(x)))) ** 2 + 1e-300, float(np.max(x * x)) + 1e-300, 0.02
    likely = plain
    for _ in range(EM_STEPS):
        low = (1 - part) / np.sqrt(narrow) * np.exp(-0.5 * x * x / narrow)
        high = part / np.sqrt(wide) * np.exp(-0.5 * x * x / wide)
        total = low + high + 1e-300
        likely = float(np.sum(np.log(total)))
        share = high / total
        part = float(np.clip(np.mean(share), 1e-6, 0.5))
        wide = float(np.sum(share * x * x) / max(np.sum(share), 1e-300)) + 1e-300
        narrow = float(np.sum((1 - share) * x * x) / np.sum(1 - share)) + 1e-300
    return max(likely - plain, 0.0)
