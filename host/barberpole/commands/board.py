"""build, flash, record, pull, twin: what is done with a board."""

from pathlib import Path
from typing import Annotated

import typer

from barberpole.arrays.names import is_array
from barberpole.calibration import read_calibration
from barberpole.commands import array as arrays
from barberpole.commands import imcs
from barberpole.commands.console import AS_JSON, ERR, OUT, notes, print_json, progress, say, table
from barberpole.driver_board import is_driver
from barberpole.errors import InputError, must
from barberpole.link.deploy import Flashed
from barberpole.link.deploy import flash as flash_board
from barberpole.link.deploy import pull as pull_run
from barberpole.link.record import record as record_board
from barberpole.link.record import soft_reset
from barberpole.log import read_log, write_log

RECORDS, TABLES = ".bpr", (".csv", ".parquet")
SECOND_US = 1e6
WAYS = {
    "mpy": ".mpy files, of the file system",
    "romfs": "ROMFS image, of the partition",
    "frozen": "frozen (estimated), of the flash beside MicroPython",
}
PortOption = Annotated[str, typer.Option("--port", help="Serial port, for example /dev/ttyACM0.")]


def register(app: typer.Typer) -> None:
    """Add these commands to the roof."""
    for command in (build, flash, record, pull, twin):
        app.command()(command)


def build(
    board: Annotated[str, typer.Argument(help="Board name or .toml.")],
    calibration: Annotated[Path | None, typer.Option(help="calibration.toml; without one, data-sheet values.")] = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder to write.")] = Path("build"),
    replay: Annotated[Path | None, typer.Option(help="For a coil driver: a log of a turned sensor to play.")] = None,
    path: Annotated[str, typer.Option(help="How a row is made: bytecode, viper, or auto (by flip rate).")] = "auto",
    as_json: bool = AS_JSON,
) -> None:
    """Write the flash-resident modules, .mpy files, manifest, ROMFS image and budget."""
    if is_driver(board):
        made = imcs.build_driver(board, replay, output, None if as_json else _dim)
        print_json(made) if as_json else say(f"trajectory {made['trajectory']} in {output}")
        return
    if is_array(board):
        made = arrays.build_array(board, calibration, output, None if as_json else _dim)
        print_json(made) if as_json else say(f"calibration {made['calibration']} in {output}")
        return
    from barberpole_codegen.build import build as build_board

    from barberpole.board import load_board
    from barberpole.nominal import nominal

    target = load_board(board)
    used = read_calibration(calibration) if calibration else nominal(target)
    made = build_board(target, used, output, None if as_json else _dim, path)
    if as_json:
        head = {"output": str(output), "build": made.build, "calibration": made.calibration, "model": made.model}
        print_json({**head, "budget": made.budget})
    else:
        OUT.print(_budget_table(made.budget))


def _dim(text: str) -> None:
    say(text, "dim")


def _budget_table(budget: dict):
    shown = table("budget", "what", "figure")
    for way, room in budget["ways"].items():
        fits = "" if room["fits"] else ": does not fit"
        shown.add_row(WAYS[way], f"{room['bytes']} of {room['of']} bytes{fits}")
    for what, figure in budget["time_us"].items():
        if isinstance(figure, int | float):
            shown.add_row(what.replace("_", " "), f"{figure:.0f} µs" if figure < SECOND_US else f"{figure / 1e6:.3f} s")
    shown.add_row("a streamed row", budget["time_us"]["path"])
    if budget["fixed_point"]:
        figure = f"{budget['fixed_point']['error_nt']:.2g} nT within ±{budget['fixed_point']['range_ut']:g} µT"
        shown.add_row("fixed-point error", figure)
    for what, fraction in budget["float32_error_of_full_scale"].items():
        shown.add_row(f"float32 error, {what}", f"{fraction:.1e} of full scale")
    return shown


def flash(
    folder: Annotated[Path, typer.Argument(help="Folder made by build.")],
    port: PortOption,
    way: Annotated[
        str, typer.Option(help="mpy, romfs or frozen; auto: what the board's firmware is made for.")
    ] = "auto",
    remove_shadows: Annotated[
        bool, typer.Option(help="Remove files that are imported instead of the build's.")
    ] = False,
    as_json: bool = AS_JSON,
) -> None:
    """Put a build on a board (.mpy files or ROMFS image; a frozen one is only checked), verify it there, restart it."""
    done = flash_board(folder, port, lambda text: ERR.print(text, style="dim"), way, remove_shadows)
    if as_json:
        print_json(_flashed(done))
    elif done.passed:
        notes(tuple(f"{path} is not used: the build is found before it" for path in done.strays.idle))
        runs = f"calibration {done.calibration} (build {done.build}, {done.way})"
        say(f"{port} runs {runs if done.calibration else f'build {done.build} ({done.way})'}")  # a coil driver has none
    else:
        for reason in done.reasons:
            say(f"not flashed: {reason}")
    if not done.passed:
        raise typer.Exit(1)


def _flashed(done: Flashed) -> dict:
    head = {"port": done.port, "pass": done.passed, "way": done.way, "build": done.build}
    told = {"reasons": list(done.reasons), "shadows": list(done.strays.shadows), "idle": list(done.strays.idle)}
    copied = {"copied": list(done.copied), "romfs_bytes_written": done.romfs_bytes_written}
    return {**head, "calibration": done.calibration, "sha256": done.sha256, **copied, **told}


def record(
    port: PortOption,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Board records (.bpr); .csv or .parquet: a table beside them.")
    ],
    rows: Annotated[int | None, typer.Option(min=1, help="Stop after so many records.")] = None,
    seconds: Annotated[float | None, typer.Option(min=0.1, help="Stop after so many seconds.")] = None,
    restart: Annotated[bool, typer.Option(help="Begin with a soft reset, so that the power-up is in the log.")] = True,
    as_json: bool = AS_JSON,
) -> None:
    """Record what a board streams, until --rows, --seconds or Ctrl-C."""
    raw = _raw(output, *TABLES)
    with progress("recording", rows) as tick:
        kept = record_board(port, raw, rows, seconds, soft_reset if restart else lambda _: None, tick, True)
    if raw != output:
        write_log(read_log(raw), output)
    if as_json:
        print_json({"output": str(output), "records": kept})
    else:
        say(f"{kept} records written to {raw}" + (f", as a table to {output}" if raw != output else ""))


def _raw(output: Path, *tables: str) -> Path:
    """Where the board's records go: beside a table that is made of them."""
    if output.suffix not in (RECORDS, *tables):
        wanted = f"a file that ends in {', '.join((RECORDS, *tables))}"
        raise InputError(must("what the board's records are written to", wanted, output))
    return output.with_suffix(RECORDS)


def pull(
    port: PortOption,
    output: Annotated[Path, typer.Option("-o", "--output", help="Board records (.bpr).")],
    as_json: bool = AS_JSON,
) -> None:
    """Fetch the coil run and the verdict of the last power-up from the board's flash; the board stops streaming."""
    pull_run(port, _raw(output))
    if as_json:
        print_json({"output": str(output)})
    else:
        say(f"written to {output}")


def twin(
    board: Annotated[str, typer.Argument(help="Board name or .toml.")],
    hidden: Annotated[list[str] | None, typer.Option(help="Effect in the board's truth; repeat for several.")] = None,
    seed: Annotated[int, typer.Option(help="Noise and magnetisation.")] = 0,
    flash_dir: Annotated[Path | None, typer.Option("--flash", help="Folder of the flash image, kept.")] = None,
    fault: Annotated[list[str] | None, typer.Option(help="What is broken; repeat for several.")] = None,
    romfs: Annotated[int, typer.Option(min=0, max=256, help="KiB of a ROMFS partition; 0: stock firmware.")] = 0,
    frozen: Annotated[Path | None, typer.Option(help="Build folder that stands in for frozen modules.")] = None,
    coils: Annotated[Path | None, typer.Option(help="Record of a coil driver, in whose coils the board lies.")] = None,
    gradient: Annotated[
        tuple[float, float, float], typer.Option(help="nT/m around an array, x y z along its first baseline.")
    ] = (0.0, 0.0, 0.0),
    as_json: bool = AS_JSON,
) -> None:
    """Start the emulated board; its port is the first line. Ctrl-C switches it off."""
    from barberpole.twin.command import run_twin

    def say(port: str) -> None:
        print_json({"port": port, "board": board}) if as_json else print(port)

    run_twin(board, tuple(hidden or ()), seed, flash_dir, tuple(fault or ()), romfs, frozen, coils, gradient, say)
