"""Programs of the ambient field: fixed, held at stations, tumbling. Times in s from power-up, fields in µT, (3, n)."""

import itertools
import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))
HOME_UT = (18.0, -6.0, 44.0)  # a northern mid-latitude field of 48 µT, board level


class Ambient(Protocol):
    """A field over time, with what the emulator needs to know to leave work undone."""

    def field_ut(self, t_s: np.ndarray) -> np.ndarray:
        """Field (3, n) in µT at t_s (n,)."""
        ...

    def constant_until(self, t_s: float) -> float:
        """End of the stretch of constant field that t_s is in; t_s itself where the field moves."""
        ...

    def steps_s(self) -> tuple[float, ...]:
        """Times of the jumps of the field."""
        ...


@dataclass(frozen=True)
class Fixed:
    """A constant field."""

    vector_ut: tuple[float, float, float] = HOME_UT

    def field_ut(self, t_s: np.ndarray) -> np.ndarray:
        return np.repeat(np.asarray(self.vector_ut, float)[:, None], t_s.size, axis=1)

    def constant_until(self, t_s: float) -> float:
        return math.inf

    def steps_s(self) -> tuple[float, ...]:
        return ()


@dataclass(frozen=True)
class Stations:
    """Step and hold: (duration_s, bx, by, bz) one after the other; the last one stays."""

    holds: tuple[tuple[float, float, float, float], ...]

    @classmethod
    def on_sphere(
        cls, count: int, magnitudes_ut: tuple[float, ...] = (50.0,), hold_s: float = 0.5, first_s: float = 0.0
    ) -> "Stations":
        """`count` directions spread evenly over the sphere in a scrambled order, the magnitudes in turn.

        The first `first_s` seconds keep the first station, long enough for a self-calibration at power-up.
        """
        order = np.random.default_rng(count).permutation(count)
        up = 1.0 - (2.0 * order + 1.0) / count
        turn = GOLDEN_ANGLE * order
        level = np.sqrt(1.0 - up * up)
        unit = np.stack([level * np.cos(turn), level * np.sin(turn), up], axis=1)
        sizes = np.resize(magnitudes_ut, count)
        holds = [(hold_s, float(x), float(y), float(z)) for x, y, z in unit * sizes[:, None]]
        holds[0] = (first_s + hold_s, *holds[0][1:])
        return cls(tuple(holds))

    def field_ut(self, t_s: np.ndarray) -> np.ndarray:
        place = np.searchsorted(self.steps_s(), t_s, side="right")
        return np.asarray(self.holds, float)[place, 1:].T

    def constant_until(self, t_s: float) -> float:
        return next((step for step in self.steps_s() if step > t_s), math.inf)

    def steps_s(self) -> tuple[float, ...]:
        return tuple(itertools.accumulate(hold[0] for hold in self.holds[:-1]))


@dataclass(frozen=True)
class Tumble:
    """A field of constant magnitude whose direction winds over the whole sphere: pole to pole, round and round."""

    magnitude_ut: float = 48.0
    turn_s: float = 1.7
    """s. One turn about the pole."""
    sweep_s: float = 31.0
    """s. From one pole to the other and back; keep it no simple multiple of turn_s."""

    def field_ut(self, t_s: np.ndarray) -> np.ndarray:
        up = np.cos(2.0 * np.pi * t_s / self.sweep_s)
        turn = 2.0 * np.pi * t_s / self.turn_s
        level = np.sin(2.0 * np.pi * t_s / self.sweep_s)
        return self.magnitude_ut * np.stack([level * np.cos(turn), level * np.sin(turn), up])

    def constant_until(self, t_s: float) -> float:
        return t_s

    def steps_s(self) -> tuple[float, ...]:
        return ()


@dataclass(frozen=True)
class Stepped:
    """Another program with a jump added from one moment on: something magnetic moved near the board."""

    base: Ambient
    at_s: float
    jump_ut: tuple[float, float, float]

    def field_ut(self, t_s: np.ndarray) -> np.ndarray:
        jump = np.asarray(self.jump_ut, float)[:, None] * (t_s >= self.at_s)
        return self.base.field_ut(t_s) + jump

    def constant_until(self, t_s: float) -> float:
        until = self.base.constant_until(t_s)
        return min(until, self.at_s) if t_s < self.at_s else until

    def steps_s(self) -> tuple[float, ...]:
        return tuple(sorted((*self.base.steps_s(), self.at_s)))
