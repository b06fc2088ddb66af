"""Noise of the converter's inputs as a function of seed and time: the same board at the same moment reads the same.

White noise is drawn in blocks, one generator per block, so what was read before does not change what is read next.
1/f noise is a sum of first-order low-pass noises with time constants a factor apart (its spectrum is 1/f between the
slowest and the fastest corner); skipped blocks are jumped over exactly.
"""

import math
from dataclasses import dataclass

import numpy as np

BLOCK = 256  # conversions drawn at once
FASTEST_S, SLOWEST_S, RATIO = 1e-3, 10.0, 4.0


@dataclass(frozen=True)
class NoiseLevel:
    """What each of the inputs carries."""

    white_v: tuple[float, ...]
    """V rms of one conversion, per input."""
    flicker_v2: tuple[float, ...]
    """V². The density of the 1/f noise at 1 Hz, one-sided, per input."""
    period_s: float
    """s. One conversion."""


class Noise:
    """Noise voltages of conversion number k since power-up."""

    def __init__(self, level: NoiseLevel, seed: int, power_up: int):
        self._level = level
        self._key = (seed, power_up)
        self._first = -1
        self._rows: list[list[float]] = []
        self._block = np.empty((0, 0))  # the same
        self._former: tuple[int, list[list[float]]] = (-1, [])  # 1/f noise cannot be drawn backwards
        self._has_flicker = any(level.flicker_v2)
        self._taus_s = FASTEST_S * RATIO ** np.arange(1 + math.log(SLOWEST_S / FASTEST_S, RATIO))
        self._slow = np.zeros((len(self._taus_s), len(level.white_v)))
        self._slow_at = 0
        steps = np.exp(-level.period_s / self._taus_s) if self._has_flicker else ()
        self._memory = [_low_pass(step) for step in steps]

    def at(self, index: int) -> list[float]:
        """Volts on every input at conversion `index`."""
        row = index - self._first
        if self._first < 0 or not 0 <= row < BLOCK:
            if 0 <= index - self._former[0] < BLOCK and self._former[1]:
                return self._former[1][index - self._former[0]]
            self._former = (self._first, self._rows)
            self._draw(index // BLOCK)
            row = index - self._first
        return self._rows[row]

    def rows(self, index: int, count: int) -> np.ndarray:
        """Volts (count, inputs) at conversion `index` and those after it."""
        at = index - self._first
        if self._first >= 0 and 0 <= at <= BLOCK - count:
            return self._block[at : at + count]
        return np.array([self.at(index + i) for i in range(count)])

    def _draw(self, block: int) -> None:
        random = np.random.default_rng((*self._key, block))
        volts = random.standard_normal((BLOCK, len(self._level.white_v))) * self._level.white_v
        if self._has_flicker:
            volts += self._flicker(random, block * BLOCK)
        self._first = block * BLOCK
        self._block, self._rows = volts, volts.tolist()

    def _flicker(self, random: np.random.Generator, first: int) -> np.ndarray:
        """The next block (BLOCK, inputs) in V of the sum of low-pass noises."""
        power_v2 = math.log(RATIO) * np.asarray(self._level.flicker_v2)
        skipped_s = max(first - self._slow_at, 0) * self._level.period_s
        total = np.zeros((BLOCK, power_v2.size))
        for i, tau_s in enumerate(self._taus_s):
            kept = math.exp(-skipped_s / tau_s) if self._slow_at else 0.0  # at power-up: from its steady state
            start = kept * self._slow[i] + math.sqrt(1.0 - kept * kept) * random.standard_normal(power_v2.size)
            path = self._memory[i] @ np.vstack([start, random.standard_normal(total.shape)])
            self._slow[i] = path[-1]
            total += path
        self._slow_at = first + BLOCK
        return total * np.sqrt(power_v2)


def _low_pass(step: float) -> np.ndarray:
    """Matrix (BLOCK, 1 + BLOCK) from a start and white kicks to a path of unit power that keeps `step` of itself."""
    age = np.subtract.outer(np.arange(1, 1 + BLOCK), np.arange(1 + BLOCK))
    matrix = np.where(age >= 0, step ** np.maximum(age, 0), 0.0)
    matrix[:, 1:] *= math.sqrt(1.0 - step * step)
    return matrix
