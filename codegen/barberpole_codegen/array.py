"""`barberpole build` for an array: a calibration module for every sensor, and the firmware that runs them together.

bp_board and bp_trajectory are those of any board; each sensor has its own bp_calibration_<name>. The folder has the
form of a sensor board's build, so that `flash` takes both.
"""

import hashlib
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from barberpole import paths
from barberpole.board import Board
from barberpole.built import MAIN
from barberpole.calibration import Calibration
from barberpole.errors import InputError, must

from barberpole_codegen import budget
from barberpole_codegen.folder import require_replaceable
from barberpole_codegen.modules import Generated, generate
from barberpole_codegen.roles import Compiled, Head, RoleBuild, room, write_role
from barberpole_codegen.rows import BYTECODE, free_us

ROLE = "array"
Progress = Callable[[str], None]
SHARED = (
    MAIN,
    *(f"bp_{name}.py" for name in ("ads131m08", "clock", "coils", "compensate", "console", "dac80504", "duty")),
    *(
        f"bp_{name}.py"
        for name in ("fixed", "flip", "frame", "givens", "log", "native", "points", "reasons", "records")
    ),
    *(f"bp_{name}.py" for name in ("sampler", "selfcal", "store", "watchdog")),
)
"""Of the firmware of one sensor; what stands on its one calibration has its counterpart in firmware/arrays."""


def build_array(
    board: Board, calibrations: Mapping[str, Calibration], out_dir: str | Path, progress: Progress | None = None
) -> RoleBuild:
    """Build for the board of an array into `out_dir`, which is new, empty, or a former build.

    calibrations: of each sensor, by its name. Raises InputError or LimitError; then nothing changed.
    """
    say, out_dir = progress or (lambda _: None), Path(out_dir)
    names = [member.name for member in board.members]
    if sorted(calibrations) != sorted(names):
        raise InputError(must("the calibrations", f"of {', '.join(names)}", ", ".join(calibrations), board.name))
    require_replaceable(out_dir)
    say("tracing the compensation of each sensor and checking it in float32")
    made = {name: generate(board, calibrations[name], BYTECODE) for name in names}
    table = made[names[0]].table
    models = sorted({calibrations[name].model.hash for name in names})
    head = Head(ROLE, board.name, " ".join(models), joined_hash(calibrations), table.id)
    return write_role(out_dir, head, sources(made), partial(_costs, board, made), say)


def sources(made: Mapping[str, Generated]) -> dict[str, str]:
    """Text by file name. The role is in bp_main, which main.py of all roles runs."""
    folder = paths.firmware()
    texts = {name: (folder / name).read_text() for name in SHARED}
    texts |= {path.name: path.read_text() for path in sorted((folder / "arrays").glob("*.py"))}
    return texts | generated(made)


def generated(made: Mapping[str, Generated]) -> dict[str, str]:
    """The generated modules: those of the board once, a calibration for each sensor."""
    texts = dict(next(iter(made.values())).texts)
    del texts["bp_calibration.py"]
    return texts | {f"bp_calibration_{name}.py": one.texts["bp_calibration.py"] for name, one in made.items()}


def joined_hash(calibrations: Mapping[str, Calibration]) -> str:
    """12 hex digits of all calibrations with their sensors' names."""
    text = " ".join(f"{name} {calibrations[name].hash}" for name in sorted(calibrations))
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def _costs(board: Board, made: Mapping[str, Generated], compiled: Compiled) -> dict[str, Any]:
    """budget.json. Raises LimitError where the files exceed the board's file system."""
    names = sorted(name.removesuffix(".py") for name in generated(made))
    return room(board, compiled) | {
        "ram_on_import_bytes": budget.ram_on_import(compiled.rom, names),
        "points_bytes": sum(54 * one.table.points for one in made.values()),
        "time_us": _times_us(board, made),
        "float32_error_of_full_scale": {
            f"{name}.{function}": p.fraction for name, one in made.items() for function, p in one.precision.items()
        },
    }


def _times_us(board: Board, made: Mapping[str, Generated]) -> dict[str, Any]:
    """Of one sensor each (as budget.times_us says), added up: a row holds all, a point is solved for each."""
    of = {name: budget.times_us(one.programs, board, one.hot, one.path) for name, one in made.items()}
    cycles_us = board.selfcal.points * (board.selfcal.settle_cycles + board.selfcal.cycles_per_point)
    cycles_us *= 1e6 / board.flip.rate_hz
    arithmetic_us = sum(one["selfcal_run"] - cycles_us for one in of.values())
    first = next(iter(of.values()))
    return {
        "sample": sum(one["sample"] for one in of.values()),
        "free_for_a_row": round(free_us(board)),
        "flip_cycle": first["flip_cycle"],
        "selfcal_point": sum(one["selfcal_point"] for one in of.values()),
        "selfcal_run": round(cycles_us + arithmetic_us),
        "meaning": first["meaning"],
        "sources": first["sources"],
    }
