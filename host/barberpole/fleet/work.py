"""What is done with one log, in whatever process: a row of plain numbers and strings, or the reason why not."""

import hashlib
import json
import math
import warnings
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import barberpole.blas  # noqa: F401  (one thread a process, whoever started it: it comes before numpy)
from barberpole.board import load_sensor
from barberpole.calibrating import calibration_of
from barberpole.calibration import Calibration, read_calibration
from barberpole.errors import BarberpoleError, InputError, must
from barberpole.fit.fit import Fit, fit_observations
from barberpole.fleet.identity import identity
from barberpole.fleet.settings import Settings
from barberpole.log import Log, read_log
from barberpole.modelfile import ModelFile
from barberpole.observations import observations
from barberpole.plugins import load_plugins
from barberpole.sensor import Sensor

Row = dict[str, Any]
TOLD = ("uid", "board_id", "lot", "date", "sensor")  # what a log's metadata may tell of the board


def work(paths: Sequence[str], settings: Settings) -> list[Row]:
    """One row a log, in order. Never raises for a log: a bad one is a row with its reason."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # what they warn of shows in the answer, or is refused
        return [_plain(row_of(Path(path), settings)) for path in paths]


def row_of(path: Path, settings: Settings) -> Row:
    """The row of one log. `log_sha256` is None where the file cannot be read: the next run tries it again."""
    row: Row = {"log": str(path), "log_sha256": None, "told": {}, "status": "failed", "reason": None}
    try:
        row["log_sha256"] = sha256(path)
        log = read_log(path)
        row["told"] = {key: str(log.meta[key]) for key in TOLD if log.meta.get(key)}
        return row | {"n": log.n, "skipped": log.skipped} | DOES[settings.do](log, settings) | {"status": "ok"}
    except (BarberpoleError, OSError) as error:
        return row | {"reason": " ".join(str(error).split())}
    except Exception as error:  # noqa: BLE001  (whatever one log provokes, the others go on; the row tells)
        return row | {"reason": f"{type(error).__name__}: {' '.join(str(error).split())}"}


def sha256(path: str | Path) -> str:
    """Hash of a file's bytes. Raises OSError."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def lost(path: str, error: BaseException) -> Row:
    """The row of a log over which its process ended."""
    said = " ".join(str(error).split()) or type(error).__name__
    reason = must("the log", "one that a process can finish", said)
    return {"log": path, "log_sha256": None, "told": {}, "status": "failed", "reason": reason}


def _fit(log: Log, settings: Settings) -> Row:
    file = _model(settings)
    seen = observations(log, _sensor(log, settings, file))
    found = fit_observations(seen, file, _plugins(file.plugins))
    return fitted_row(found, calibration_of(found, log, file))


def fitted_row(fit: Fit, calibration: Calibration) -> Row:
    """A calibration as a row: parameters with standard errors, covariance, residual and validity."""
    return {
        "reference": fit.problem.seen.reference,
        "converged": fit.converged,
        "condition": fit.condition,
        "parameters": {name: [v.value, v.stderr] for name, v in calibration.parameters.items()},
        "units": {name: v.unit for name, v in calibration.parameters.items()},
        "covariance": calibration.covariance.ravel().tolist(),
        "unobservable": list(calibration.unobservable),
        "easy_axis": list(calibration.easy_axis),
        "t0_c": calibration.t0_c,
        "calibration": calibration.hash,
        **{key: value for key, value in vars(calibration.residual).items() if key != "n"},
        "residuals": calibration.residual.n,
        **vars(calibration.validity),
    }


def _verify(log: Log, settings: Settings) -> Row:
    from barberpole.verify import verify

    held = _calibration(log, settings)
    found = verify(log, held).to_json()
    known = ("rms_lsb", "calibration_rms_lsb", "rms_norm_percent", "calibration_norm_percent", "gain_drift")
    return {
        "pass": found["pass"],
        "reasons": found["reasons"],
        "calibration": held.hash,
        **{key: found[key] for key in known if key in found},
    }


def _diagnose(log: Log, settings: Settings) -> Row:
    from barberpole.diagnose import diagnose
    from barberpole.fleet.scores import scores

    file = _model(settings)
    extra = _plugins(file.plugins)
    said = diagnose(log, file, None, _sensor(log, settings, file), extra)
    row: Row = {}
    if said.fits:
        row = fitted_row(said.fits[0], calibration_of(said.fits[0], log, file))
        row["scores"] = json.dumps(_plain(scores(said.fits[0], file, log.has("state"), extra)))
    shown = said.to_json()
    row |= {key: shown[key] for key in ("verdict", "noise_lsb", "rms_lsb", "cannot_be_seen", "next_experiment")}
    return row | {key: json.dumps(_plain(shown[key])) for key in ("suspects", "patterns", "cannot_be_judged")}


DOES: dict[str, Callable[[Log, Settings], Row]] = {"fit": _fit, "verify": _verify, "diagnose": _diagnose}


def _model(settings: Settings) -> ModelFile:
    if settings.model is None:
        raise InputError(must("the fleet", "given a --model", "none"))
    return settings.model


@lru_cache(maxsize=4)
def _plugins(paths: tuple[str, ...]):
    return load_plugins(paths)


@lru_cache(maxsize=16)
def _named(name: str) -> Sensor:
    return load_sensor(name)


def _sensor(log: Log, settings: Settings, file: ModelFile) -> Sensor | None:
    """The sensor of the command line, of the model file, or of the board that wrote the log."""
    name = settings.sensor or file.sensor or log.meta.get("sensor")
    return _named(name) if name else None


def _calibration(log: Log, settings: Settings) -> Calibration:
    """What this log is held against: one file for all, one by the board's name, or the board's latest in a fleet."""
    source = settings.calibration or ""
    board = identity(log.path, log.meta, settings.name).board
    if source.endswith(".parquet"):
        return _of_fleet(source).calibration(board)
    return _read(source.replace("{board}", board))


@lru_cache(maxsize=256)
def _read(path: str) -> Calibration:
    return read_calibration(path)


@lru_cache(maxsize=1)
def _of_fleet(path: str):
    from barberpole.fleet.table import read_fleet

    return read_fleet(path)


def _plain(value: Any) -> Any:
    """As JSON holds it: what is not a finite number becomes None."""
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if hasattr(value, "item"):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
