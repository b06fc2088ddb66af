"""characterise: the data sheet of one sensor from its logs; simulate: logs of a sensor that a file describes."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from barberpole import __version__
from barberpole.board import load_sensor
from barberpole.challenge.motion import smooth
from barberpole.characterise.simulate import readings
from barberpole.columns import FIELD, READINGS
from barberpole.commands.console import AS_JSON, OUT, notes, print_json, say, table
from barberpole.errors import InputError, must
from barberpole.log import Log, read_log, write_log
from barberpole.numbers import uncertain
from barberpole.sensor import Sensor
from barberpole.trajectory.programs import FREQUENCIES_HZ, SINE_PEAK_TO_PEAK_UT, lin_60000

if TYPE_CHECKING:
    from barberpole.characterise.sheet import Sheet

PROGRAMS = ("linearity", "rest", "sine", "turned")
REPEATS = 25  # readings of each field of the linearity program
REST_S, TONE_S = 300.0, 60.0  # article 2.4: five minutes of noise; long enough for the slowest sine
TURNED, EARTH_UT = 3000, 48.0  # readings of a sensor turned through all directions, and the field it turns in


def register(app: typer.Typer) -> None:
    """Add these commands to the roof."""
    app.command()(characterise)
    app.command()(simulate)


def characterise(
    logs: Annotated[list[Path], typer.Argument(help="Logs of one sensor: linearity, rest, sines, turn-over, ...")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Where to write the page (.html).")] = None,
    name: Annotated[str, typer.Option(help="Name of the sensor, for the title.")] = "sensor",
    as_json: bool = AS_JSON,
) -> None:
    """One sensor's data sheet, in the form of the article's table 1, with uncertainties."""
    from barberpole.characterise.sheet import make_sheet  # here: scipy.signal is slow to load

    read = [read_log(path) for path in logs]
    sheet = make_sheet(read)
    if output:
        from barberpole.characterise.page import write_sheet  # here: drawing is slow to load

        hashes = "\n".join(f"{log.path.name}  {log.sha256}" for log in read)
        write_sheet(output, f"Data sheet: {name}", sheet, f"barberpole {__version__}\n{hashes}")
    if as_json:
        print_json(_json(sheet))
        return
    notes(sheet.notes)
    shown = table(f"data sheet of {name}", "quantity", "case", "value", "unit")
    for f in sheet.figures:
        shown.add_row(f.quantity, f.case, uncertain(f.value, f.stderr), f.unit)
    OUT.print(shown)
    if output:
        say(f"page written to {output}")


def _json(sheet: "Sheet") -> dict:
    """The figures as objects; an error that is not known is null."""
    rows = [
        {
            "quantity": f.quantity,
            "case": f.case,
            "value": f.value,
            "stderr": f.stderr if np.isfinite(f.stderr) else None,
            "unit": f.unit,
        }
        for f in sheet.figures
    ]
    return {"figures": rows, "notes": list(sheet.notes)}


def simulate(
    sensor: Annotated[str, typer.Argument(help="Sensor name or .toml with a table sensor.digital.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Log to write (.csv or .parquet).")],
    program: Annotated[str, typer.Option(help=f"One of {', '.join(PROGRAMS)}.")] = "linearity",
    temp: Annotated[float, typer.Option(help="Temperature in °C.")] = 25.0,
    seed: Annotated[int, typer.Option(help="Which sensor of the kind.")] = 0,
    as_json: bool = AS_JSON,
) -> None:
    """A log as a digital sensor of this kind would write it under a field program."""
    kind = load_sensor(sensor)
    log = _simulated(kind, program, temp, seed, output)
    write_log(log, output)
    if as_json:
        print_json({"sensor": kind.name, "program": program, "n": log.n, "log": str(output)})
    else:
        say(f"{log.n} readings of a {kind.name} ({program}) written to {output}")


def _simulated(kind: Sensor, program: str, temp_c: float, seed: int, path: Path) -> Log:
    rate_hz = kind.digital.rate_hz if kind.digital else 1.0
    if program not in PROGRAMS:
        raise InputError(must("the program", f"one of {', '.join(PROGRAMS)}", repr(program)))
    extra: dict[str, np.ndarray] = {}
    if program == "linearity":
        field = np.repeat(lin_60000().field_ut, REPEATS, axis=0).T
        extra = dict(zip(FIELD, field, strict=True))
    elif program == "rest":
        field = np.zeros((3, round(REST_S * rate_hz)))
    elif program == "turned":
        field = EARTH_UT * smooth(TURNED, np.random.default_rng(seed))
    else:
        t = np.arange(round(TONE_S * rate_hz)) / rate_hz
        half = 0.5 * SINE_PEAK_TO_PEAK_UT / np.sqrt(3.0)  # the sensor is slanted: all axes see the same
        wave = np.concatenate([half * np.sin(2.0 * np.pi * f * t) for f in FREQUENCIES_HZ])
        field = np.tile(wave, (3, 1))
        extra = {"f_hz": np.repeat(FREQUENCIES_HZ, len(t))}
    y = readings(kind, field, temp_c, seed)
    n = y.shape[1]
    columns = {"t_s": np.arange(n) / rate_hz, **dict(zip(READINGS, y, strict=True)), "temp_c": np.full(n, temp_c)}
    return Log(columns | extra, path, "")
