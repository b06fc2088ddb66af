"""trajectory: a sequence of coil currents as DAC codes, checked against the board."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from barberpole.board import load_board
from barberpole.commands.console import AS_JSON, print_json, say
from barberpole.errors import InputError, must
from barberpole.files import write_atomic
from barberpole.log import read_log
from barberpole.trajectory import CodeTable, Trajectory, axes, code_table, for_board, replay, sine, sphere, steps

SHAPES = ("board", "sphere", "axes", "steps", "sine", "replay")
CYCLE_POINTS = 24  # of a sine


def register(app: typer.Typer) -> None:
    """Add this command to the roof."""
    app.command()(trajectory)


def trajectory(
    board: Annotated[str, typer.Argument(help="Board name or .toml.")],
    shape: Annotated[str, typer.Option(help=f"One of {', '.join(SHAPES)}; board: as its file says.")] = "board",
    radii: Annotated[str, typer.Option(help="Radii, amplitudes or levels in µT, separated by commas.")] = "40,80",
    points: Annotated[int, typer.Option(help="Points (sphere, replay) or cycles (axes, sine).")] = 132,
    axis: Annotated[str, typer.Option(help="Axis of steps and sine.")] = "x",
    log: Annotated[Path | None, typer.Option(help="Log whose applied field is replayed.")] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="CSV of currents and codes.")] = None,
    as_json: bool = AS_JSON,
) -> None:
    """Compute a sequence of coil currents and check it against the board's limits."""
    target = load_board(board)
    made = for_board(target) if shape == "board" else _shaped(shape, _numbers(radii), points, axis, log)
    table = code_table(made, target)
    if output:
        write_atomic(output, _csv(table))
    if as_json:
        print_json(_summary(table))
    else:
        largest = ", ".join(f"{ma:.3g}" for ma in table.unit_ma)
        say(f"{table.name}: {table.points} points in {len(table.bytes)} bytes, id {table.id}")
        say(f"largest currents {largest} mA (x, y, z)")
        if output:
            say(f"written to {output}")


def _shaped(shape: str, values_ut: tuple[float, ...], points: int, axis: str, log: Path | None) -> Trajectory:
    if shape == "sphere":
        return sphere(values_ut, points)
    if shape == "axes":
        return axes(values_ut, points)
    if shape == "steps":
        return steps(values_ut, axis)
    if shape == "sine":
        return sine(values_ut[0], axis, points, CYCLE_POINTS)
    if shape == "replay" and log:
        return replay(read_log(log), points)
    wanted = f"one of {', '.join(SHAPES)}" if shape != "replay" else "given with --log"
    raise InputError(must("the shape", wanted, repr(shape)))


def _numbers(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise InputError(must("--radii", "numbers in µT separated by commas", repr(text))) from None


def _summary(table: CodeTable) -> dict:
    return {
        "name": table.name,
        "points": table.points,
        "unit_ma": list(table.unit_ma),
        "block": table.block,
        "bytes": len(table.bytes),
        "id": table.id,
    }


def _csv(table: CodeTable) -> str:
    rows = np.hstack([table.current_ma, table.codes])
    lines = [f"{k}," + ",".join(f"{v:.9g}" for v in row) for k, row in enumerate(rows)]
    return "point,ix_ma,iy_ma,iz_ma,code_x,code_y,code_z\n" + "\n".join(lines) + "\n"
