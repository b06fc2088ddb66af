"""Calibrations: a fitted model with its uncertainty, where it holds, and how it came about.

A calibration is a TOML file, and every number comes back from it exactly. Its hash names model, parameters and the
coils' factory response; the board carries it, so that a log says which calibration compensated it.
"""

from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit
from tomlkit.items import Table

from barberpole.calibration_tables import (
    CalibrationTables,
    ModelTable,
    PriorTable,
    Residual,
    SelfcalReference,
    Step,
    Validity,
    Value,
)
from barberpole.errors import InputError, must
from barberpole.files import write_atomic
from barberpole.modelfile import ModelFile, relative, short_hash
from barberpole.tables import read_toml, validate

__all__ = [
    "Calibration",
    "PriorTable",
    "Residual",
    "SelfcalReference",
    "Step",
    "Validity",
    "Value",
    "calibration_text",
    "read_calibration",
    "write_calibration",
]

FORMAT = 1
WHAT = "the calibration file"


@dataclass(frozen=True, eq=False)
class Calibration:
    """What `calibration.toml` holds.

    parameters      "effect.parameter" -> Value, in the order of the covariance (P, P)
    unobservable    names of parameters that the log could not determine: they stay at their null
    easy_axis       component along the easy axis of the x, y and z bridge; t0_c the reference temperature
    """

    model: ModelFile
    parameters: dict[str, Value]
    covariance: np.ndarray
    residual: Residual
    log_name: str
    log_sha256: str
    unobservable: tuple[str, ...] = ()
    validity: Validity = field(default_factory=Validity)
    history: tuple[Step, ...] = ()
    selfcal: SelfcalReference | None = None
    prior: PriorTable | None = None
    easy_axis: tuple[int, int, int] = (1, 0, 1)
    t0_c: float = 25.0
    method: str = "fit"
    path: Path | None = None

    @property
    def hash(self) -> str:
        """12 hex digits of model, parameters and coil response: the same for the same compensation."""
        selfcal = asdict(self.selfcal) if self.selfcal else None
        parameters = {name: asdict(value) for name, value in self.parameters.items()}
        return short_hash([self.model.hash, parameters, selfcal, list(self.easy_axis), self.t0_c])


def read_calibration(path: str | Path) -> Calibration:
    """Raises InputError where the file is not a calibration of this format."""
    path = Path(path)
    tables = read_toml(path, WHAT)
    if tables.get("format") != FORMAT:
        raise InputError(must(WHAT, f"of format {FORMAT}", f"format {tables.get('format')}", path))
    file = validate(CalibrationTables, tables, WHAT, path)
    parameters = {f"{effect}.{name}": value for effect, of in file.parameters.items() for name, value in of.items()}
    return Calibration(
        model=_model(file.model, path),
        parameters=parameters,
        covariance=_square(file.covariance.matrix, len(parameters), path),
        residual=file.residual,
        log_name=file.log.name,
        log_sha256=file.log.sha256,
        unobservable=file.unobservable,
        validity=file.validity,
        history=file.history,
        selfcal=file.selfcal,
        prior=file.prior,
        easy_axis=file.easy_axis,
        t0_c=file.t0_c,
        method=file.method,
        path=path,
    )


def write_calibration(calibration: Calibration, path: str | Path) -> None:
    """Write it whole or not at all. Raises InputError if the folder is not there."""
    write_atomic(path, calibration_text(calibration, Path(path)))


def calibration_text(calibration: Calibration, path: Path) -> str:
    """The TOML text; plugins are named relative to the folder of `path`."""
    document = tomlkit.document()
    document.add(tomlkit.comment(f"barberpole calibration {calibration.hash}. Units: µT, °C, mA, LSB."))
    document["format"] = FORMAT
    for key in ("method", "t0_c", "easy_axis", "unobservable"):
        document[key] = _plain(getattr(calibration, key))
    document["model"] = _model_table(calibration.model, path)
    document["log"] = {"name": calibration.log_name, "sha256": calibration.log_sha256}
    for key in ("residual", "validity", "selfcal", "prior"):
        if (table := getattr(calibration, key)) is not None:
            document[key] = _table(table)
    document["parameters"] = _parameters(calibration.parameters)
    document["covariance"] = _covariance(calibration)
    if calibration.history:
        document["history"] = [_table(step) for step in calibration.history]
    return tomlkit.dumps(document)


def _model(model: ModelTable, path: Path) -> ModelFile:
    plugins = tuple(str(path.parent / plugin) for plugin in model.plugins)
    return ModelFile(model.effects, model.settings, model.reference, plugins, model.sensor)


def _model_table(model: ModelFile, path: Path) -> dict[str, Any]:
    table = {
        "effects": list(model.effects),
        "plugins": [relative(plugin, path.parent) for plugin in model.plugins],
        "settings": model.settings,
        "reference": model.reference,
    }
    return {**table, "sensor": model.sensor} if model.sensor else table


def _square(matrix: tuple[tuple[float, ...], ...], size: int, path: Path) -> np.ndarray:
    if len(matrix) != size or any(len(row) != size for row in matrix):
        raise InputError(
            must("covariance.matrix", f"{size} rows of {size}, one for each parameter", "another shape", path)
        )
    return np.array(matrix, float).reshape(size, size)


def _parameters(parameters: dict[str, Value]) -> dict[str, Any]:
    """Tables by effect; each parameter on a line of its own."""
    tables: dict[str, Any] = {}
    for full_name, value in parameters.items():
        effect, _, name = full_name.partition(".")
        line = tomlkit.inline_table()
        line.update(_table(value))
        tables.setdefault(effect, {})[name] = line
    return tables


def _covariance(calibration: Calibration) -> Table:
    table = tomlkit.table()
    table.add(tomlkit.comment("rows and columns in the order of the parameters above"))
    matrix = tomlkit.array()
    for row in np.asarray(calibration.covariance, float).tolist():
        matrix.append(row)
    table["matrix"] = matrix.multiline(len(matrix) > 0)
    return table


def _table(value: Any) -> dict[str, Any]:
    """A dataclass as TOML can hold it: what is not known is left out."""
    known = {f.name: getattr(value, f.name) for f in fields(value)}
    return {name: _plain(item) for name, item in known.items() if item is not None}


def _plain(value: Any) -> Any:
    """numpy numbers and tuples as plain floats and lists."""
    if isinstance(value, tuple | list | np.ndarray):
        return [_plain(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value
