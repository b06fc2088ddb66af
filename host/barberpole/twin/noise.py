"""Noise of the converter's inputs as a function of seed and time: the same board at the same moment reads the same.

White noise is drawn in blocks, one generator per block, so what was read before does not change what is read next.
1/f noise is a sum of first-order low-pass noises with time constants a factor apart (its spectrum is 1/f between the
slowest and the fastest corner); skipped blocks are jumped over exactly.
"""

import math
from collections.abc import Sequence
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
        self._first = -BLOCK
        self._block = np.empty((0, 0))
        self._former = (-BLOCK, self._block)  # 1/f noise cannot be drawn backwards
        self._has_flicker = any(level.flicker_v2)
        self._taus_s = FASTEST_S * RATIO ** np.arange(1 + math.log(SLOWEST_S / FASTEST_S, RATIO))
        self._slow = np.zeros((len(self._taus_s), len(level.white_v)))
        self._slow_at = 0
        steps = np.exp(-level.period_s / self._taus_s) if self._has_flicker else ()
        self._memory = [_low_pass(step) for step in steps]

    def at(self, index: int) -> np.ndarray:
        """Volts (inputs,) at conversion `index`."""
        return self.rows([index])[0]

    def rows(self, indices: Sequence[int]) -> np.ndarray:
        """Volts (n, inputs) at the conversions `indices`, which ascend."""
        first, last = indices[0] - self._first, indices[-1] - self._first
        if first < 0 or last >= BLOCK:
            return np.array([self._block_of(index)[index % BLOCK] for index in indices])
        if last - first == len(indices) - 1:
            return self._block[first : last + 1]
        return self._block[[index - self._first for index in indices]]

    def _block_of(self, index: int) -> np.ndarray:
        """The block that a conversion is in."""
        place = index // BLOCK * BLOCK
        if place == self._former[0]:
            return self._former[1]
        if place != self._first:
            self._former = (self._first, self._block)
            self._draw(index // BLOCK)
        return self._block

    def _draw(self, block: int) -> None:
        random = np.random.default_rng((*self._key, block))
        volts = random.standard_normal((BLOCK, len(self._level.white_v))) * self._level.white_v
        if self._has_flicker:
            volts += self._flicker(random, block * BLOCK)
        self._first, self._block = block * BLOCK, volts

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
