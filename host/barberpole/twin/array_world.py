"""What surrounds an emulated array: a world for each sensor, in one field that changes along the first baseline."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from barberpole.board import Board
from barberpole.twin.ambient import Ambient, Fixed
from barberpole.twin.world import BIAS_UT, COIL_SPREAD, GAIN_SPREAD, Triple, World

NONE: Triple = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Elsewhere:
    """A field program at another place: the same with a constant difference."""

    base: Ambient
    shift_ut: Triple

    def field_ut(self, t_s: np.ndarray) -> np.ndarray:
        return self.base.field_ut(t_s) + np.asarray(self.shift_ut)[:, None]

    def constant_until(self, t_s: float) -> float:
        return self.base.constant_until(t_s)

    def steps_s(self) -> tuple[float, ...]:
        return self.base.steps_s()


@dataclass(frozen=True)
class ArrayWorld:
    """The world of each sensor, in the order of the array; each is another specimen."""

    worlds: tuple[World, ...]

    @classmethod
    def of(
        cls,
        board: Board,
        hidden: tuple[str, ...] = ("cross_field",),
        ambient: Ambient | None = None,
        gradient_nt_per_m: Triple = NONE,
        gain_drift: Mapping[str, Triple] | None = None,
        **changes,
    ) -> "ArrayWorld":
        """The worlds of this array. Raises InputError on an unknown effect.

        gradient_nt_per_m: change of each component per metre along the first baseline; gain_drift: by the name of a
        sensor; changes: fields of every World.
        """
        base = ambient or Fixed()
        worlds = []
        for index, member in enumerate(board.members):
            shift = 1e-3 * along_m(board, index) * np.asarray(gradient_nt_per_m)
            own = {"gain_drift": (gain_drift or {}).get(member.name, (1.0, 1.0, 1.0)), **_specimen(index), **changes}
            there = Elsewhere(base, _triple(shift)) if np.any(shift) else base
            worlds.append(World.of(board, hidden, ambient=there, **own))
        return cls(tuple(worlds))


def along_m(board: Board, index: int) -> float:
    """How far a sensor lies from the first, along the first baseline, m."""
    places = 1e-3 * np.array([member.position_mm for member in board.members])
    baseline = places[1] - places[0]
    return float((places[index] - places[0]) @ baseline / np.linalg.norm(baseline))


def _specimen(index: int) -> dict:
    """No two sensors are alike: the spreads of World, each time another axis's."""
    spreads = {"gain_spread": GAIN_SPREAD, "coil_spread": COIL_SPREAD, "bias_ut": BIAS_UT}
    return {name: _triple(np.roll(spread, index)) for name, spread in spreads.items()}


def _triple(values) -> Triple:
    x, y, z = (float(v) for v in values)
    return x, y, z
