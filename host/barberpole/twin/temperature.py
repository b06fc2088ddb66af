"""Programs of the temperature: constant, or up and down again. Times in s from power-up, °C, (n,)."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np


class Temperature(Protocol):
    """A temperature over time."""

    def temp_c(self, t_s: np.ndarray) -> np.ndarray:
        """Temperature (n,) in °C at t_s (n,)."""
        ...

    def constant_until(self, t_s: float) -> float:
        """End of the stretch of constant temperature that t_s is in; t_s itself where it moves."""
        ...


@dataclass(frozen=True)
class Constant:
    """One temperature."""

    level_c: float = 25.0

    def temp_c(self, t_s: np.ndarray) -> np.ndarray:
        return np.full(t_s.shape, self.level_c)

    def constant_until(self, t_s: float) -> float:
        return math.inf


@dataclass(frozen=True)
class Cycle:
    """Constant for `rest_s`, then up to high_c, down to low_c and so on in straight lines, one cycle in period_s."""

    low_c: float = 15.0
    high_c: float = 45.0
    period_s: float = 60.0
    rest_s: float = 0.0

    def temp_c(self, t_s: np.ndarray) -> np.ndarray:
        # a triangle wave that starts half way up, so that the rest joins on without a jump
        phase = (np.maximum(t_s - self.rest_s, 0.0) / self.period_s + 0.25) % 1.0
        return self.low_c + (self.high_c - self.low_c) * (1.0 - np.abs(2.0 * phase - 1.0))

    def constant_until(self, t_s: float) -> float:
        return self.rest_s if t_s < self.rest_s else t_s


@dataclass(frozen=True)
class Plateaus:
    """Each level in turn for `hold_s`, after the first one for another `rest_s`; the last one stays."""

    levels_c: tuple[float, ...] = (25.0, 40.0, 32.0, 25.0, 15.0, 20.0)
    hold_s: float = 10.0
    rest_s: float = 0.0

    def temp_c(self, t_s: np.ndarray) -> np.ndarray:
        place = np.floor(np.maximum(t_s - self.rest_s, 0.0) / self.hold_s).astype(int)
        return np.asarray(self.levels_c, float)[np.minimum(place, len(self.levels_c) - 1)]

    def constant_until(self, t_s: float) -> float:
        if t_s < self.rest_s:
            return self.rest_s + self.hold_s
        place = math.floor((t_s - self.rest_s) / self.hold_s) + 1
        return self.rest_s + place * self.hold_s if place < len(self.levels_c) else math.inf
