"""array calibrate | selfcal | gradient: several sensors on one board."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from barberpole.commands.console import AS_JSON, OUT, print_json, say, table
from barberpole.commands.reference import DateOption, MagnitudeOption, PlaceOption, magnitude_ut

app = typer.Typer(no_args_is_help=True, help="Several sensors on one board: calibrated in one run; their gradient.")
ArrayOption = Annotated[str, typer.Option("--array", help="Array name or .toml.")]
CalibrationOption = Annotated[Path, typer.Option("--calibration", help="What `array calibrate` or `selfcal` wrote.")]
OutOption = Annotated[Path, typer.Option("-o", "--output", help="The array's calibration (.toml).")]


def register(roof: typer.Typer) -> None:
    """Add these commands to the roof."""
    roof.add_typer(app, name="array")


@app.command()
def calibrate(
    log: Annotated[Path, typer.Argument(help="The array turned through all directions.")],
    output: OutOption,
    array: ArrayOption = "gradiometer",
    run: Annotated[Path | None, typer.Option(help="A coil run of the same day, for `selfcal` later.")] = None,
    magnitude: MagnitudeOption = None,
    place: PlaceOption = None,
    date: DateOption = None,
    as_json: bool = AS_JSON,
) -> None:
    """Calibrate all sensors of an array from one turned log, into one frame (thesis 4.20, 6.2)."""
    from barberpole.arrays.array_file import load_array
    from barberpole.arrays.array_log import read_array_log
    from barberpole.arrays.calibrate import coil_run, factory, turned
    from barberpole.arrays.keeping import write_array
    from barberpole.fit.fit import NOMINAL_MAGNITUDE_UT

    target = load_array(array)
    logs = read_array_log(log, target)
    known = magnitude_ut(next(iter(logs.values())), magnitude, place, date)
    found = turned(logs, NOMINAL_MAGNITUDE_UT if known is None else known)
    if run:
        found = factory(found, coil_run(read_array_log(run, target), target))
    write_array(found, target.name, output)
    _show(found, output, as_json)


@app.command()
def selfcal(
    run: Annotated[Path, typer.Argument(help="A coil run of today, through all offset coils in series.")],
    calibration: CalibrationOption,
    output: OutOption,
    array: ArrayOption = "gradiometer",
    as_json: bool = AS_JSON,
) -> None:
    """Bring all sensors up to date from one coil run (thesis 6.7)."""
    from barberpole.arrays.array_file import load_array
    from barberpole.arrays.array_log import read_array_log
    from barberpole.arrays.calibrate import coil_run, today
    from barberpole.arrays.keeping import read_array, write_array

    target = load_array(array)
    then = read_array(calibration, target.names)
    found = today(then, coil_run(read_array_log(run, target), target), target.shielded)
    write_array(found, target.name, output)
    _show(found, output, as_json)


@app.command()
def gradient(
    log: Annotated[Path, typer.Argument(help="A log of the array.")],
    calibration: CalibrationOption,
    array: ArrayOption = "gradiometer",
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Fields and gradients (.csv, .parquet).")
    ] = None,
    as_json: bool = AS_JSON,
) -> None:
    """Fields of all sensors, and the gradient along each baseline in nT/m."""
    from barberpole.arrays.array_file import load_array
    from barberpole.arrays.array_log import read_array_log
    from barberpole.arrays.calibrate import fields_of
    from barberpole.arrays.gradient import gradients
    from barberpole.arrays.keeping import read_array
    from barberpole.arrays.table import write_fields

    target = load_array(array)
    logs = read_array_log(log, target)
    fields = fields_of(read_array(calibration, target.names), logs)
    found = gradients(target, fields)
    if output:
        write_fields(next(iter(logs.values())), fields, found, output)
    pairs = [
        {
            "from": g.first,
            "to": g.second,
            "baseline_m": g.baseline_m,
            "direction": g.direction.tolist(),
            "mean_nt_per_m": g.mean.tolist(),
            "rms_change_nt_per_m": g.rms_change.tolist(),
        }
        for g in found
    ]
    if as_json:
        print_json({"n": found[0].nt_per_m.shape[1], "gradients": pairs})
        return
    shown = table("gradient along each baseline", "pair", "baseline, m", "x", "y", "z", "± rms of a row, nT/m")
    for g in found:
        mean = [f"{v:.1f}" for v in g.mean]
        shown.add_row(f"{g.first} to {g.second}", f"{g.baseline_m:.3f}", *mean, f"{np.max(g.rms_change):.1f}")
    OUT.print(shown)


@app.command("simulate")
def simulate_logs(
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder of the four logs.")],
    array: ArrayOption = "gradiometer",
    seed: Annotated[int, typer.Option(min=0, help="Of the specimens and the noise.")] = 0,
    as_json: bool = AS_JSON,
) -> None:
    """Logs of an emulated array: turned, a coil run, one after a drift, and at rest in a gradient of 300 nT/m in x."""
    from barberpole.arrays.array_file import load_array
    from barberpole.arrays.simulate import simulate

    output.mkdir(parents=True, exist_ok=True)
    drift = simulate(load_array(array), output, seed)
    if as_json:
        print_json({"output": str(output), "hidden_gain": {name: d.tolist() for name, d in drift.items()}})
    else:
        say(f"turned.csv, run.csv, later.csv and seen.csv written to {output}")


def build_array(name: str, calibration: Path | None, output: Path, say: Callable[[str], None] | None) -> dict:
    """`build` for an array; calibration: what `array calibrate` wrote. What `build --json` prints."""
    from barberpole_codegen.array import build_array as build

    from barberpole.arrays.array_file import load_array_board
    from barberpole.arrays.for_board import of_each
    from barberpole.arrays.keeping import read_array
    from barberpole.nominal import nominal

    board = load_array_board(name)
    names = tuple(member.name for member in board.members)
    if calibration:
        used = of_each(read_array(calibration, names), board, calibration.name)
    else:
        used = dict.fromkeys(names, nominal(board))
    made = build(board, used, output, say)
    hashes = {name: of.hash for name, of in used.items()}
    head = {"output": str(output), "role": "array", "build": made.build, "calibration": made.calibration}
    return {**head, "sensors": hashes, "budget": made.budget}


def _show(found, output: Path, as_json: bool) -> None:
    """Gains over those of the turned log, in ppm; what the turned log left."""
    sensors = {
        name: {"gain": found.gain[name].tolist(), "left_ut": found.left_ut.get(name), "coil_run": name in found.carried}
        for name in found.affine
    }
    if as_json:
        print_json({"output": str(output), "sensors": sensors})
        return
    shown = table("gains over those of the turned log, ppm", "sensor", "x", "y", "z", "|H| - K rms, nT")
    for name, s in sensors.items():
        left = "" if s["left_ut"] is None else f"{1000 * s['left_ut']:.1f}"
        shown.add_row(name, *(f"{1e6 * (g - 1):+.0f}" for g in s["gain"]), left)
    OUT.print(shown)
    say(f"calibration written to {output}")
