"""methods, calibrate-over-temperature, and what `fit --method` runs and shows."""

from pathlib import Path
from typing import Annotated

import numpy as np
import tomlkit
import typer
from tomlkit.items import InlineTable

from barberpole.board import load_sensor
from barberpole.calibration import read_calibration
from barberpole.calibration_tables import Value
from barberpole.commands.console import AS_JSON, OUT, notes, print_json, say, table
from barberpole.commands.reference import DateOption, MagnitudeOption, PlaceOption, magnitude_ut
from barberpole.files import write_atomic
from barberpole.fit.answer import remarks
from barberpole.log import Log, read_log
from barberpole.methods.answer import Answer, Given, Values
from barberpole.methods.over_temperature import values_of
from barberpole.methods.over_temperature_log import from_logs
from barberpole.methods.registry import ELSEWHERE, METHODS, find_method
from barberpole.modelfile import read_model
from barberpole.numbers import with_error

FORMAT = 1
QUALITY = ("rms_lsb", "rms_ut", "rms_norm_percent", "heldout_rms_lsb")


def register(app: typer.Typer) -> None:
    """Add these commands to the roof."""
    app.command()(methods)
    app.command("calibrate-over-temperature")(calibrate_over_temperature)


def methods(as_json: bool = AS_JSON) -> None:
    """The published methods: name, equations, the source's own words, what each needs of a log."""
    if as_json:
        fields = ("name", "equations", "words", "needs")
        elsewhere = [dict(zip(("command", "equations", "words"), entry, strict=True)) for entry in ELSEWHERE]
        print_json({"methods": [{key: getattr(m, key) for key in fields} for m in METHODS], "elsewhere": elsewhere})
        return
    shown = table("methods, for fit --method NAME", "name", "equations", "in the source", "needs")
    for column in shown.columns:
        column.justify = "left"
    for m in METHODS:
        shown.add_row(m.name, m.equations, m.words, m.needs)
    OUT.print(shown)
    others = table("the sources' other methods", "command or module", "equations", "in the source")
    for column in others.columns:
        column.justify = "left"
    for entry in ELSEWHERE:
        others.add_row(*entry)
    OUT.print(others)


def calibrate_over_temperature(
    logs: Annotated[list[Path], typer.Argument(help="One log a temperature, five or more.")],
    magnitude: MagnitudeOption = None,
    place: PlaceOption = None,
    date: DateOption = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="TOML of the polynomials.")] = None,
    as_json: bool = AS_JSON,
) -> None:
    """Quadratic bias and cubic scale factors over temperature (thesis 6.1.3.2)."""
    read = [read_log(path) for path in logs]
    known_ut = magnitude_ut(read[0], magnitude, place, date)
    found = from_logs(read, Given({} if known_ut is None else {"magnitude_ut": known_ut}))
    answer = Answer(values_of(found), notes=(f"{len(read)} temperatures",))
    write_and_show(answer, read[0], "calibrate-over-temperature", output, as_json)


def run(
    data: Log, method: str, model: str, sensor: str | None, against: Path | None, known_ut: float | None = None
) -> Answer:
    """The method on a log, with what the command line and the log's board say beside it; known_ut: |B|."""
    file = read_model(model) if model else None
    magnitude = {} if known_ut is None else {"magnitude_ut": known_ut}
    name = sensor or (file.sensor if file else None) or data.meta.get("sensor")
    return find_method(method).run(
        data,
        Given(
            (dict(file.reference) if file else {}) | magnitude,
            load_sensor(name) if name else None,
            read_calibration(against) if against else None,
        ),
    )


def write_and_show(answer: Answer, data: Log, method: str, output: Path | None, as_json: bool) -> None:
    """An answer that is a table of its own and no calibration."""
    if output:
        write_atomic(output, values_text(answer.values, data, method))
    if as_json:
        print_json(_quality_json(answer, data) | to_json(answer, method))
    else:
        notes(data.notes)
        show_values(answer)
        if output:
            say(f"figures written to {output}")


def _quality_json(answer: Answer, data: Log) -> dict:
    """What every fit says, of a method whose answer is no set of effects; a closed form converges."""
    found = {"n": data.n}
    if answer.quality:
        found |= {key: getattr(answer.quality, key) for key in QUALITY}
    return found | {
        "parameters": _figures(answer.parameters),
        "converged": True,
        "unobservable": [],
        "skipped": data.skipped,
    }


def _figures(values: Values) -> dict:
    return {name: {"value": v.value, "stderr": v.stderr, "unit": v.unit} for name, v in values.items()}


def to_json(answer: Answer | None, method: str | None) -> dict:
    """The method's part of `fit --json`; empty without one."""
    if answer is None:
        return {}
    found = {"method": method, "values": _figures(answer.values)}
    said = remarks(answer.fit) if answer.fit else ()
    return found | {"notes": [*said, *answer.notes]}


def show_values(answer: Answer | None) -> None:
    """The method's own figures, for people."""
    if answer is None:
        return
    shown = table("in the method's own terms", "figure", "value", "± 1 σ", "unit")
    for name, v in answer.values.items():
        shown.add_row(name, *with_error(v.value, v.stderr), v.unit)
    OUT.print(shown)
    for note in answer.notes:
        say(note)


def values_text(values: Values, data: Log, method: str) -> str:
    """The figures as TOML: what is not known is left out."""
    document = tomlkit.document()
    document.add(tomlkit.comment(f"barberpole fit --method {method}: figures of the method, no calibration"))
    document["format"] = FORMAT
    document["method"] = method
    document["log"] = {"name": data.path.name, "sha256": data.sha256}
    document["values"] = {name: _line(v) for name, v in values.items()}
    return tomlkit.dumps(document)


def _line(v: Value) -> InlineTable:
    line = tomlkit.inline_table()
    known = {"value": v.value, "unit": v.unit} | ({} if np.isnan(v.stderr) else {"stderr": v.stderr})
    line.update(known)
    return line
