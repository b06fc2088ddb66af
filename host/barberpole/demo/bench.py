"""The laboratory of the demo: an emulated board at a station that applies known fields, as a coil system would."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from barberpole_codegen.build import build

from barberpole.board import Board
from barberpole.calibration import Calibration
from barberpole.columns import FIELD
from barberpole.errors import PortError, must
from barberpole.link.deploy import flash, pull
from barberpole.link.record import record
from barberpole.log import Log, read_log
from barberpole.twin.ambient import Stations
from barberpole.twin.api import Twin
from barberpole.twin.temperature import Plateaus
from barberpole.twin.world import World

TRUE_EFFECTS = ("misalignment", "cross_field", "sensitivity_temperature", "flip_asymmetry", "bias_temperature")
"""What the specimen on the bench really has, beside bias and scale; the demo's model lacks the hidden one."""

MAGNITUDES_UT = (30.0, 45.0, 60.0)
HOLD_S = 0.04
TEMPERATURES_C = (25.0, 33.0, 40.0, 30.0, 20.0, 15.0, 22.0, 30.0, 36.0, 25.0)
POWER_UP_S = 3.0  # the field and the temperature rest until the self-calibration is over
GUARD_S = 0.006  # a row this close to a step of the field has seen both sides of it


@dataclass(frozen=True)
class Session:
    """One power-up at the station: rows with the applied field, the coil run, and what was true meanwhile."""

    log: Log
    run: Log
    truth: dict
    seconds: float


@dataclass(frozen=True)
class Bench:
    """The board on the bench, its flash kept between power-ups in `folder`."""

    board: Board
    folder: Path
    seed: int
    say: Callable[[str], None]

    @contextmanager
    def on(self, world: World) -> Iterator[Twin]:
        """The board, powered in this world."""
        with Twin(self.board, self.folder / "flash", world, seed=self.seed) as twin:
            yield twin

    def station(self, count: int, **drift) -> World:
        """`count` known fields one after the other, the oven up, down and up again."""
        fields = Stations.on_sphere(count, MAGNITUDES_UT, hold_s=HOLD_S, first_s=POWER_UP_S)
        warm = Plateaus(TEMPERATURES_C, count // len(TEMPERATURES_C) * HOLD_S, rest_s=POWER_UP_S)
        return World.of(self.board, TRUE_EFFECTS, ambient=fields, temperature=warm, **drift)

    def deploy(self, twin: Twin, calibration: Calibration, name: str) -> None:
        """Build for the board and flash it with mpremote."""
        folder = self.folder / name
        build(self.board, calibration, folder, self.say)
        done = flash(folder, twin.port, self.say)
        if not done.passed:
            raise PortError(must("the board", "one that takes this build", "; ".join(done.reasons), twin.port))

    def power_up(self, twin: Twin, name: str, rows: int, tick: Callable[[int], None] | None = None) -> Session:
        """Power cycle, let it calibrate itself, record its rows, then pull the coil run from its flash."""
        self.say("power cycle: the board calibrates itself, then streams")
        streamed, run = self.folder / f"{name}.bpr", self.folder / f"{name}-selfcal.bpr"
        record(twin.port, streamed, frames=rows, start=lambda _: twin.power_cycle(), tick=tick)
        truth, seconds = twin.truth(), twin.virtual_time_s()
        pull(twin.port, run)
        return Session(with_field(read_log(streamed), twin.world), read_log(run), truth, seconds)


def with_field(log: Log, world: World) -> Log:
    """The rows taken in a steady field, with that field as the station's reference instrument gives it."""
    kept = log.take(world.steady(log["t_s"], GUARD_S) & (log["t_s"] > POWER_UP_S))
    return replace(kept, columns={**kept.columns, **dict(zip(FIELD, world.field(kept["t_s"]), strict=True))})


def scale_at_reference(truth: dict, t0_c: float) -> np.ndarray:
    """True LSB/µT of the three axes today, brought to the reference temperature of the calibration."""
    drift = np.asarray(truth["parameters"]["sensitivity_per_c"]) * (truth["temp_c"] - t0_c)
    return np.asarray(truth["scale_lsb_per_ut"]) / (1.0 + drift)
