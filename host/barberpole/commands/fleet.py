"""fleet: many boards, each by itself; then what they tell together."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Annotated

import typer
from typer.core import TyperGroup

from barberpole.commands.console import AS_JSON, ERR, OUT, notes, print_json, say, table
from barberpole.errors import InputError, must
from barberpole.numbers import plain

FIRST = "fit"  # what `barberpole fleet 'logs/*.parquet' -o fleet.parquet` does
BAD_INPUT = 2
LISTED = 5  # of a kind, in words

Patterns = Annotated[list[str], typer.Argument(help="Logs, folders, or globs in quotes: 'logs/*.parquet'.")]
Output = Annotated[Path, typer.Option("-o", "--output", help="The table, one row a log (.parquet).")]
Model = Annotated[str, typer.Option("--model", help="model.toml, or a list such as bias,scale,misalignment.")]
Sensor = Annotated[str | None, typer.Option(help="Sensor name or .toml: easy axes.")]
Name = Annotated[
    str | None, typer.Option(help="Regular expression for board, date and lot in a path: (?P<board>..)_(?P<date>..).")
]
Processes = Annotated[int | None, typer.Option(help="Processes here; as many as there are cores if not given.", min=1)]
Dask = Annotated[str | None, typer.Option(help="Address of a Dask scheduler (extra: fleet), tcp://host:8786.")]
Table = Annotated[Path, typer.Argument(help="What `fleet` wrote (.parquet).")]
Lot = Annotated[str | None, typer.Option(help="One lot of several: the folder its logs are in, or what the log says.")]
LINEAR = "bias,scale,misalignment"


class DefaultGroup(TyperGroup):
    """Without a command of its own name, what follows `fleet` is for `--do`, which is fit if not given."""

    def parse_args(self, ctx, args):
        if args and args[0] not in self.commands and args[0] not in ("--help", "-h"):
            args = _with_command(list(args))
        return super().parse_args(ctx, args)


def _with_command(args: list[str]) -> list[str]:
    from barberpole.fleet.settings import TASKS

    do = FIRST
    for at, arg in enumerate(args):
        if arg == "--do" or arg.startswith("--do="):
            size = 1 if "=" in arg else 2
            do = arg.partition("=")[2] if size == 1 else (args[at + 1] if at + 1 < len(args) else "")
            args = args[:at] + args[at + size :]
            break
    if do not in TASKS:
        raise InputError(must("--do", " or ".join(TASKS), repr(do)))
    return [do, *args]


def register(app: typer.Typer) -> None:
    """Add these commands to the roof."""
    group = typer.Typer(
        cls=DefaultGroup,
        help="Many boards: fit, verify or diagnose every log, here or on a Dask cluster; then compare them. "
        "`barberpole fleet 'logs/*.parquet' -o fleet.parquet [--do verify]` is short for `fleet fit ...`.",
        no_args_is_help=True,
    )
    for command in (fit, verify, diagnose, report, common, extract):
        group.command()(command)
    app.add_typer(group, name="fleet")


def fit(
    logs: Patterns,
    output: Output,
    model: Model = LINEAR,
    sensor: Sensor = None,
    name: Name = None,
    processes: Processes = None,
    dask: Dask = None,
    as_json: bool = AS_JSON,
) -> int:
    """Calibrate every log: one row each, with parameters, standard errors and covariance."""
    return _any(_run("fit", logs, output, model, None, sensor, name, processes, dask, as_json))


def verify(
    logs: Patterns,
    output: Output,
    calibration: Annotated[
        str, typer.Option(help="calibration.toml, a path with {board} in it, or the table of a fleet fit.")
    ],
    name: Name = None,
    processes: Processes = None,
    dask: Dask = None,
    as_json: bool = AS_JSON,
) -> int:
    """Hold every log against its board's calibration. Exit 1 if a board is not what it was, 2 if one cannot be held."""
    rows = _run("verify", logs, output, None, calibration, None, name, processes, dask, as_json)
    if any(row.get("pass") is False for row in rows):
        return 1
    return 0 if all("pass" in row for row in rows) else BAD_INPUT


def diagnose(
    logs: Patterns,
    output: Output,
    model: Model = LINEAR,
    sensor: Sensor = None,
    name: Name = None,
    processes: Processes = None,
    dask: Dask = None,
    as_json: bool = AS_JSON,
) -> int:
    """Diagnose every log, and keep what each effect would take of it: `fleet report` adds that up over the boards."""
    return _any(_run("diagnose", logs, output, model, None, sensor, name, processes, dask, as_json))


def report(
    fleet: Table,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Where to write the page (.html).")] = None,
    lot: Lot = None,
    as_json: bool = AS_JSON,
) -> None:
    """What the boards tell together: what they share, which stand out and why, which have changed."""
    from barberpole.fleet.summary import summarise
    from barberpole.fleet.table import of_lot, read_fleet
    from barberpole.report.fleet import verdict, write_fleet_report

    chosen = of_lot(read_fleet(fleet), lot)
    found = summarise(chosen)
    if output:
        write_fleet_report(found, chosen, output)
    if as_json:
        print_json(found.to_json())
        return
    say(verdict(found), "bold")
    for one in found.outliers[:LISTED]:
        say(f"{one.board}: {one.why}")
    for one in found.changes[:LISTED]:
        say(f"{one.board}: {one.why}")
    for where, effects in found.lots.items():
        for one in effects:
            rivals = f"; cannot be told from {', '.join(one.rivals)}" if one.rivals else ""
            say(f"lot {where}: {one.effect} {one.kind}, {one.size:.2g} of the noise{rivals}")
    notes(found.notes)


def common(fleet: Table, lot: Lot = None, as_json: bool = AS_JSON) -> None:
    """Which parameters all boards share, and which are individual: scatter between boards against its uncertainty."""
    from dataclasses import asdict

    from barberpole.fleet.spread import spreads
    from barberpole.fleet.table import of_lot, read_fleet

    found = spreads(of_lot(read_fleet(fleet), lot).latest())
    if as_json:
        print_json({"parameters": {one.name: asdict(one) | {"kind": one.kind} for one in found}})
        return
    heads = ("parameter", "mean", "between", "own error", "unit", "off, LSB", "it is")
    shown = table(f"{max(one.boards for one in found)} boards, noise {found[0].noise_lsb:.3g} LSB", *heads)
    for one in found:
        figures = (f"{one.mean:.4g}", f"{one.tau:.3g}", plain(one.stderr, 2), one.unit, f"{one.error_lsb:.3g}")
        shown.add_row(one.name, *figures, one.kind)
    OUT.print(shown)


def extract(
    fleet: Table,
    board: Annotated[str, typer.Argument(help="Name of the board, as in the table.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Where to write calibration.toml.")],
    as_json: bool = AS_JSON,
) -> None:
    """One board's latest calibration as a calibration file, for `build` and `verify`."""
    from barberpole.calibration import write_calibration
    from barberpole.fleet.table import read_fleet

    found = read_fleet(fleet).calibration(board)
    write_calibration(found, output)
    if as_json:
        print_json({"output": str(output), "calibration": found.hash, "log": found.log_name})
    else:
        say(f"calibration {found.hash} of {board} written to {output}")


def _any(rows: list[dict]) -> int:
    """A failed log is a row and no failure of the run; a run without one good log is."""
    return 0 if any(row["status"] == "ok" for row in rows) else BAD_INPUT


def _run(do, patterns, output, model, calibration, sensor, name, processes, dask, as_json) -> list[dict]:
    from barberpole.fleet import pool
    from barberpole.fleet.identity import check_pattern, in_folders
    from barberpole.fleet.run import logs, run
    from barberpole.fleet.settings import settings_of
    from barberpole.modelfile import read_model

    paths = logs(patterns)
    file = read_model(model) if model else None
    pattern = check_pattern(name) if name else in_folders(paths)
    if pattern and not name and not as_json:
        notes((f"all logs are named {Path(paths[0]).name}, so each board is named after its folder (or by --name)",))
    settings = settings_of(do, file, calibration, sensor, pattern)
    where = pool.dask(dask) if dask else nullcontext(pool.processes(processes))
    try:
        with where as chosen, _boards(f"fleet {do}", len(paths)) as tick:
            found = run(paths, settings, output, chosen, tick)
    except KeyboardInterrupt:
        ERR.print(f"stopped; what is done is kept beside {output}, and the same command goes on from there")
        raise
    _show(do, found, output, as_json)
    return found.rows


@contextmanager
def _boards(what: str, total: int) -> Iterator:
    """A progress bar with boards a second; those that were done before count as done, not as speed."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeRemainingColumn

    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=ERR, transient=True, disable=not ERR.is_terminal) as bar:
        task = bar.add_task(what, total=total, rate="")

        def tick(done: int) -> None:
            bar.advance(task, done)
            speed = bar.tasks[0].speed
            bar.update(task, rate=f"{speed:.0f} boards/s" if speed else "")

        yield tick


def _show(do: str, found, output: Path, as_json: bool) -> None:
    failed = [{"log": row["log"], "reason": row["reason"]} for row in found.failed]
    rows = len(found.rows)
    counts = {"logs": rows, "ok": rows - len(failed), "failed": len(failed), "done_before": found.known}
    counts |= {"seconds": found.seconds, "logs_per_s": found.rate}
    if do == "verify":
        counts["not_passed"] = sum(not row.get("pass", True) for row in found.rows)
    if as_json:
        print_json({"do": do, "output": str(output), **counts, "failures": failed})
        return
    say(
        f"{counts['ok']} of {rows} logs done ({found.known} of them before), {plain(found.rate, 2)} a second; "
        f"written to {output}"
    )
    if counts["ok"]:
        OUT.print(f"all of them together: barberpole fleet report {output} -o {output.with_suffix('.html')}")
    if do == "verify":
        say(f"{counts['not_passed']} are not what their calibration says")
    for one in failed[:LISTED]:
        say(f"failed: {one['log']}: {one['reason']}", console=ERR)
    if len(failed) > LISTED:
        ERR.print(f"and {len(failed) - LISTED} more; column `reason` of {output} has them all")
