"""report and summary: a page to send, and a log at a glance."""

import shlex
from pathlib import Path
from typing import Annotated

import typer

from barberpole.board import load_sensor
from barberpole.calibration import Calibration, read_calibration
from barberpole.commands import show
from barberpole.commands.console import AS_JSON, notes, print_json, progress, say
from barberpole.errors import InputError, must
from barberpole.log import Log, read_log
from barberpole.modelfile import ModelFile, read_model
from barberpole.sensor import Sensor

EVERY = "bias,scale,misalignment"  # what every sensor has


def register(app: typer.Typer) -> None:
    """Add these commands to the roof."""
    app.command()(report)
    app.command()(summary)


def report(
    logs: Annotated[list[Path], typer.Argument(help="Logs (.csv, .parquet, .bpr); a chapter each.")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="The page, report.html if not given.")] = None,
    model: Annotated[str, typer.Option("--model", help=f"Model, {EVERY} or that of --calibration if not given.")] = "",
    calibration: Annotated[Path | None, typer.Option(help="Calibration to hold the logs against.")] = None,
    noise: Annotated[Path | None, typer.Option(help="A log of the sensor at rest.")] = None,
    sensor: Annotated[str | None, typer.Option("--sensor", help="Sensor name or .toml: easy axes and H_k.")] = None,
    as_json: bool = AS_JSON,
) -> None:
    """One page to send: verdict, model against measurement, suspects, parameters, self-calibration, provenance."""
    from barberpole.plugins import load_plugins
    from barberpole.report.report import versions, write_report
    from barberpole.report.study import Given, answers, study

    if output is None and not as_json:
        output = Path("report.html")
    if output is not None and not output.parent.is_dir():
        raise InputError(must("the folder of the page", "one that is there", "none", output.parent))
    known = read_calibration(calibration) if calibration else None
    file = _model(model, known)
    rest, extra = read_log(noise) if noise else None, load_plugins(file.plugins)
    studies = []
    with progress("report", len(logs)) as tick:
        for path in logs:
            data = read_log(path)
            studies.append(study(data, Given(file, known, rest, _sensor(data, file, sensor), extra)))
            tick(1)
    words = {"--model": model, "--calibration": calibration, "--noise": noise, "--sensor": sensor, "-o": output}
    answer = answers(studies, _command(logs, words), versions())
    if output:
        write_report(output, studies, answer)
    if as_json:
        print_json(answer)
        return
    for one in studies:
        notes(one.log.notes)
        named = ", ".join(s.effect for s in one.diagnosis.suspects) if one.diagnosis else ""
        say(f"{one.log.path.name}: {one.verdict}{': ' + named if named else ''}", style="bold")
    say(f"page written to {output}")


def _model(model: str, known: Calibration | None) -> ModelFile:
    if model or known is None:
        return read_model(model or EVERY)
    return known.model


def _sensor(data: Log, file: ModelFile, sensor: str | None) -> Sensor | None:
    name = sensor or file.sensor or data.meta.get("sensor")
    return load_sensor(name) if name else None


def _command(logs: list[Path], words: dict[str, object]) -> str:
    """The command line that gives the same again."""
    given = [str(word) for pair in words.items() if pair[1] for word in pair]
    return shlex.join(["barberpole", "report", *map(str, logs), *given])


def summary(
    log: Annotated[Path, typer.Argument(help="CSV, Parquet or board records (.bpr).")],
    sensor: Annotated[str | None, typer.Option("--sensor", help="Sensor name or .toml: easy axes.")] = None,
    as_json: bool = AS_JSON,
) -> None:
    """A log at a glance: what is in it, what is wrong with it, what it can and cannot show."""
    from barberpole.summary import summarise

    data = read_log(log)
    name = sensor or data.meta.get("sensor")
    found = summarise(data, load_sensor(name) if name else None)
    if as_json:
        print_json(found.to_json())
    else:
        show.summary(found)
