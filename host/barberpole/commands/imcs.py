"""imcs: a sensor's log and its coil driver's record as one; and what `build` does for a coil driver."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from barberpole.commands.console import AS_JSON, notes, print_json, say
from barberpole.driver_board import Driver
from barberpole.errors import InputError, must
from barberpole.imcs import join, read_driven
from barberpole.log import read_log, write_log
from barberpole.trajectory import Trajectory, replay


def register(app: typer.Typer) -> None:
    """Add these commands to the roof."""
    app.command()(imcs)


def imcs(
    log: Annotated[Path, typer.Argument(help="What the sensor board sent.")],
    driver: Annotated[Path, typer.Argument(help="What the coil driver sent meanwhile (.bpr).")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The joined log (.csv or .parquet).")],
    constants: Annotated[str | None, typer.Option(help="µT/mA of the x, y and z coil; else the driver's own.")] = None,
    as_json: bool = AS_JSON,
) -> None:
    """Join a sensor's log with its coil driver's record by time: the applied field, from the currents read back."""
    found = join(read_log(log), read_driven(driver), _constants(constants))
    write_log(found.log, output)
    if as_json:
        clocks = {"shift_s": found.clocks.shift_s, "drift_ppm": 1e6 * found.clocks.drift, "left": found.clocks.left}
        print_json({"output": str(output), "rows": found.log.n, "dropped": found.dropped, **clocks})
    else:
        notes(found.log.notes)
        say(f"{found.log.n} rows with their field written to {output}; {found.dropped} beside steps left out")


def _constants(text: str | None) -> np.ndarray | None:
    if text is None:
        return None
    try:
        values = np.array([float(part) for part in text.split(",")])
    except ValueError:
        values = np.array([])
    if values.shape != (3,) or not np.all(values > 0):
        raise InputError(must("--constants", "three coil constants in µT/mA separated by commas", repr(text)))
    return values


def build_driver(name: str, replayed: Path | None, output: Path, say: Callable[[str], None] | None) -> dict:
    """`build` for a coil driver; replayed: a log of a sensor turned by hand. What `build --json` prints."""
    from barberpole_codegen.driver import build_driver as build

    from barberpole.driver_board import load_driver

    driver = load_driver(name)
    made = build(driver, output, turned(replayed, driver) if replayed else None, say)
    return {"output": str(output), "role": driver.role, "trajectory": made.trajectory, "budget": made.budget}


def turned(path: Path, driver: Driver) -> Trajectory:
    """The field that a hand-turned sensor saw (thesis fig. 6.15), in its own frame: the log's, or by the ellipsoid."""
    from barberpole.methods.turned import field_of

    log = read_log(path)
    return replay(field_of(log), min(driver.drive.points, log.n))
