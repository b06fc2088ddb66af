"""fit, compare, diagnose, add, remove, verify, convert: what is done with a log and a model."""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated

import typer

from barberpole.adding import Change, change
from barberpole.board import load_sensor
from barberpole.calibrating import calibration_of, with_selfcal
from barberpole.calibration import Calibration, read_calibration, write_calibration
from barberpole.calibration_tables import PriorTable, Step
from barberpole.commands import big, show
from barberpole.commands import methods as published
from barberpole.commands.console import AS_JSON, ERR, notes, print_json, progress, say
from barberpole.commands.reference import DateOption, MagnitudeOption, PlaceOption, magnitude_ut, with_magnitude
from barberpole.diagnose import compare as compare_fit
from barberpole.diagnose import diagnose as diagnose_log
from barberpole.effects import Effect, alias_notes, listed_as
from barberpole.errors import BarberpoleError, InputError, must
from barberpole.fit.answer import fit_json, remarks
from barberpole.fit.fit import Fit, fit_observations
from barberpole.log import Log, read_log, write_log
from barberpole.log_stream import LogStream
from barberpole.modelfile import ModelFile, add_effect, read_model, remove_effect, write_model
from barberpole.observations import Observations, observations
from barberpole.plugins import load_plugins
from barberpole.sensor import Sensor
from barberpole.verify import verify as verify_log

LogPath = Annotated[Path, typer.Argument(help="CSV, Parquet or board records (.bpr).")]
ModelOption = Annotated[str, typer.Option("--model", help="model.toml, or a list such as bias,scale,misalignment.")]
OutOption = Annotated[Path | None, typer.Option("-o", "--output", help="Where to write calibration.toml.")]
PriorOption = Annotated[
    Path | None, typer.Option(help="Table of a fleet fit: its lot's distribution stands beside a short log.")
]
SensorOption = Annotated[str | None, typer.Option("--sensor", help="Sensor name or .toml: easy axes and H_k.")]


def register(app: typer.Typer) -> None:
    """Add these commands to the roof."""
    for command in (fit, compare, diagnose, add, remove, verify, convert):
        app.command()(command)


def fit(
    log: LogPath,
    model: ModelOption = "",
    method: Annotated[str | None, typer.Option(help="A published method by name, for example ellipsoid.")] = None,
    output: OutOption = None,
    selfcal: Annotated[Path | None, typer.Option(help="Board record with the coil run of the same day.")] = None,
    against: Annotated[Path | None, typer.Option(help="An earlier calibration, for offset_coil.")] = None,
    sensor: SensorOption = None,
    magnitude: MagnitudeOption = None,
    place: PlaceOption = None,
    date: DateOption = None,
    prior: PriorOption = None,
    lot: Annotated[str | None, typer.Option(help="The lot of --prior, where that fleet holds several.")] = None,
    as_json: bool = AS_JSON,
) -> None:
    """Fit a model to a log and write the calibration."""
    if not (model or method):
        raise InputError(must("fit", "given --model or --method", "neither"))
    if prior and (method or not model):
        raise InputError(must("--prior", "used with --model", "--method"))
    data, stream = (read_log(log), None) if method or prior else _read(log, model)
    known_ut = magnitude_ut(data, magnitude, place, date)
    answer = published.run(data, method, model, sensor, against, known_ut) if method else None
    if answer and answer.fit is None:
        published.write_and_show(answer, data, method or "", output, as_json)
        return
    stated = None
    if answer and answer.fit and answer.file:
        found, file = answer.fit, answer.file
    elif prior:
        found, file, stated = _by_prior(data, model, sensor, known_ut, prior, lot)
    else:
        found, file = _by_model(data, model, sensor, known_ut, stream)
    calibration = replace(calibration_of(found, data, file, method or "fit"), prior=stated)
    run = read_log(selfcal).selfcal if selfcal else data.selfcal
    if run is not None:
        calibration = with_selfcal(calibration, run, _sensor_of(data, file, sensor) or load_sensor("hmc1021_1022"))
    if output:
        write_calibration(calibration, output)
    notes((*alias_notes(file.effects), *remarks(found)))
    if as_json:
        beside = {"prior": asdict(stated)} if stated else {}
        print_json(fit_json(found, data.skipped) | published.to_json(answer, method) | beside)
    else:
        notes(data.notes)
        show.fit_tables(found, output)
        published.show_values(answer)


def _read(log: Path, model: str) -> tuple[Log, LogStream | None]:
    """The log, or a sample of a long one with the stream that it stands for."""
    file = read_model(model)
    return big.read(log, file, load_plugins(file.plugins))


def _by_model(
    data: Log, model: str, sensor: str | None, known_ut: float | None = None, stream: LogStream | None = None
) -> tuple[Fit, ModelFile]:
    file = with_magnitude(read_model(model), known_ut)
    if stream is not None:
        from barberpole.fit.stream import fit_stream

        with progress("fit", unit="rows") as tick:
            return fit_stream(stream, file, _sensor_of(data, file, sensor), load_plugins(file.plugins), tick), file
    seen, extra = _seen(data, file, sensor)
    with progress("fit", unit="rows") as tick:
        return fit_observations(seen, file, extra, tick), file


def _by_prior(
    data: Log, model: str, sensor: str | None, known_ut: float | None, prior: Path, lot: str | None
) -> tuple[Fit, ModelFile, PriorTable]:
    from barberpole.fit.prior import fit_with_prior  # here: few fits need it
    from barberpole.fleet.prior import prior_of, stated
    from barberpole.fleet.table import read_fleet

    file = with_magnitude(read_model(model), known_ut)
    seen, extra = _seen(data, file, sensor)
    known = prior_of(read_fleet(prior), file, lot)
    return fit_with_prior(seen, file, known, extra), file, stated(known)


def _seen(data: Log, file: ModelFile, sensor: str | None = None) -> tuple[Observations, tuple[Effect, ...]]:
    return observations(data, _sensor_of(data, file, sensor)), load_plugins(file.plugins)


def _sensor_of(data: Log, file: ModelFile, sensor: str | None) -> Sensor | None:
    """The sensor named on the command line, in the model file, or by the board that wrote the log."""
    name = sensor or file.sensor or data.meta.get("sensor")
    return load_sensor(name) if name else None


def compare(
    log: LogPath,
    model: ModelOption,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="A page of pictures (.html).")] = None,
    sensor: SensorOption = None,
    as_json: bool = AS_JSON,
) -> None:
    """Hold the model against the measurement: residual by axis and against every covariate."""
    data, stream = _read(log, model)
    made, file = _by_model(data, model, sensor, stream=stream)
    found = compare_fit(made, extra=load_plugins(file.plugins))
    if output:
        from barberpole.report.comparison import write_comparison  # here: drawing is slow to load

        write_comparison(found, made, output, log.name, model)
    notes(alias_notes(file.effects))
    if as_json:
        print_json(found.to_json())
    else:
        notes(data.notes)
        show.comparison(found)


def diagnose(
    logs: Annotated[list[Path], typer.Argument(help="One or several logs.")],
    model: ModelOption,
    noise: Annotated[Path | None, typer.Option(help="A log of the sensor at rest.")] = None,
    sensor: SensorOption = None,
    as_json: bool = AS_JSON,
) -> int:
    """Where the model fails and which physical effect is missing."""
    file = read_model(model)
    extra, rest = load_plugins(file.plugins), read_log(noise) if noise else None
    bad = 0
    for path in logs:
        try:
            data = big.read(path, file, extra)[0]  # of a long log a sample, which is searched in its place
            found = diagnose_log(data, file, rest, _sensor_of(data, file, sensor), extra)
        except BarberpoleError as error:
            if len(logs) == 1:
                raise
            bad = 2
            print_json({"log": str(path), "error": str(error)}) if as_json else ERR.print(
                f"{path}: {error}", soft_wrap=True
            )
            continue
        if as_json:
            print_json(({"log": str(path)} if len(logs) > 1 else {}) | found.to_json())
        else:
            notes(data.notes)
            show.diagnosis(path, found, model)
    notes(() if bad else alias_notes(file.effects))
    return bad


def add(
    effect: str,
    model: ModelOption,
    log: LogPath,
    output: OutOption = None,
    sensor: SensorOption = None,
    as_json: bool = AS_JSON,
) -> None:
    """Put an effect into the model file, refit, and show the error before and after.

    It is put in, and the exit code is 0, also where it does not pay: `pays` says so, and `remove` takes it out again.
    """
    _change(effect, model, log, output, sensor, as_json, add_effect)


def remove(
    effect: str,
    model: ModelOption,
    log: LogPath,
    output: OutOption = None,
    sensor: SensorOption = None,
    as_json: bool = AS_JSON,
) -> None:
    """Take an effect out of the model file, refit, and show the error before and after."""
    _change(effect, model, log, output, sensor, as_json, remove_effect)


def _change(effect, model, log, output, sensor, as_json, edit) -> None:
    data, before = read_log(log), read_model(model)
    after = edit(before, listed := listed_as(effect, before.effects))
    seen, extra = _seen(data, before, sensor)
    found = change(seen, before, after, listed, extra)
    notes(alias_notes((effect,)))
    if output:
        old = read_calibration(output) if output.exists() else None
        write_calibration(_with_history(found, data, found.after_file, old, edit is add_effect), output)
    if before.path:
        write_model(found.after_file, before.path)
    if as_json:
        print_json(found.to_json())
    else:
        notes(data.notes)
        show.change(found, before.path)


def _with_history(found: Change, data: Log, file: ModelFile, old: Calibration | None, added: bool) -> Calibration:
    first = () if old is None else old.history
    if not first:
        first = (Step(rms_lsb=found.before.rms_lsb, heldout_rms_lsb=found.before.heldout_rms_lsb),)
    names = {"added" if added else "removed": found.effect}
    step = Step(rms_lsb=found.after.rms_lsb, heldout_rms_lsb=found.after.heldout_rms_lsb, **names)
    return calibration_of(found.after, data, file, history=(*first, step))


def verify(
    log: LogPath,
    calibration: Annotated[Path, typer.Option(help="calibration.toml to hold the log against.")],
    as_json: bool = AS_JSON,
) -> int:
    """Is this board still what the calibration says? Exit 1 if not."""
    said = read_calibration(calibration)
    data, stream = big.read(log, said.model, load_plugins(said.model.plugins))
    found = verify_log(data, said, stream)
    if as_json:
        print_json(found.to_json())
    else:
        notes(data.notes)
        show.verification(found)
    return 0 if found.passed else 1


def convert(
    log: LogPath,
    output: Annotated[Path, typer.Option("-o", "--output", help=".csv or .parquet")],
    take: Annotated[
        list[str] | None,
        typer.Option(help="NAME=COLUMN[:UNIT], once for each column of another program's table: bx_ut=Bx:gauss."),
    ] = None,
    as_json: bool = AS_JSON,
) -> None:
    """Write a log in another format; with --take, make one of a table that another program wrote."""
    from barberpole.foreign import read_foreign

    data = read_foreign(log, take) if take else read_log(log)
    write_log(data, output)
    notes(data.notes)
    if as_json:
        print_json({"output": str(output), "rows": data.n, "skipped": data.skipped})
    else:
        say(f"{data.n} rows written to {output}")
