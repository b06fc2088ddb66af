"""The fleet's Parquet file: one row a log, `bias.x` beside `bias.x_stderr`, and with what it was made."""

import hashlib
import io
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pa_parquet

from barberpole.calibration import Calibration, Residual, Validity, Value
from barberpole.errors import InputError, must
from barberpole.files import read_bytes, write_atomic
from barberpole.fleet import journal
from barberpole.fleet.identity import identity
from barberpole.fleet.settings import Settings
from barberpole.fleet.trusted import FORMAT, WHAT, check_columns, check_row, checked_meta
from barberpole.log_formats import BAD_PARQUET, check_claims
from barberpole.modelfile import ModelFile

Row = dict[str, Any]
META = b"barberpole_fleet"
FIRST = ("log", "board", "lot", "date", "log_sha256", "status", "reason", "n")
TYPES = {
    "n": pa.int64(),
    "skipped": pa.int64(),
    "residuals": pa.int64(),
    "reason": pa.string(),
    "date": pa.string(),
    "log_sha256": pa.string(),
    "pass": pa.bool_(),
    "converged": pa.bool_(),
    **dict.fromkeys(("parameters", "unobservable", "reasons", "cannot_be_seen"), pa.list_(pa.string())),
    **dict.fromkeys(("covariance", "field_min_ut", "field_max_ut"), pa.list_(pa.float64())),
    "easy_axis": pa.list_(pa.int64()),
}
JSON = ("suspects", "patterns", "cannot_be_judged", "scores", "told")
TEXT = ("log", "board", "lot", "status", "reference", "calibration", "verdict", "next_experiment", *JSON)


@dataclass(frozen=True, eq=False)
class Fleet:
    """Rows in the order of their logs. do: what was done; meta: with which model and settings."""

    rows: list[Row]
    do: str
    meta: dict[str, Any]
    path: Path
    sha256: str

    @property
    def model(self) -> ModelFile:
        """The model of the fits. Raises InputError if there is none."""
        held = self.meta.get("model")
        if not held:
            raise InputError(must("the fleet", "one of `fleet fit` or `fleet diagnose`", f"fleet {self.do}", self.path))
        return ModelFile(
            tuple(held["effects"]), held["settings"], held["reference"], tuple(held["plugins"]), held["sensor"]
        )

    @property
    def fitted(self) -> list[Row]:
        """Rows with parameters."""
        return [row for row in self.rows if row["status"] == "ok" and row.get("parameters")]

    @property
    def failed(self) -> list[Row]:
        return [row for row in self.rows if row["status"] != "ok"]

    def boards(self) -> dict[str, list[Row]]:
        """Fitted rows by board, each board's in the order of their dates."""
        found: dict[str, list[Row]] = {}
        for row in sorted(self.fitted, key=lambda row: (row["date"] or "", row["log"])):
            found.setdefault(row["board"], []).append(row)
        return found

    def latest(self, lot: str | None = None) -> list[Row]:
        """The last fitted row of every board (of a lot), so that no board counts twice."""
        last = [rows[-1] for rows in self.boards().values()]
        return [row for row in last if lot is None or row["lot"] == lot]

    def calibration(self, board: str) -> Calibration:
        """A board's latest calibration. Raises InputError where the fleet has none."""
        rows = self.boards().get(board)
        if not rows:
            raise InputError(must(f"board {board}", "one that was fitted in the fleet", "none of it", self.path))
        return calibration_of_row(rows[-1], self.model, self.meta["units"])


def calibration_of_row(row: Row, model: ModelFile, units: dict[str, str]) -> Calibration:
    """The calibration that a row stands for."""
    nan = float("nan")
    parameters = {
        name: Value(value, nan if error is None else error, units[name])
        for name, (value, error) in row["parameters"].items()
    }
    covariance = np.array([nan if c is None else c for c in row["covariance"]])
    known: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in row.items()}
    residual: dict[str, Any] = {f.name: known.get(f.name) for f in fields(Residual) if f.name != "n"}
    return Calibration(
        model=model,
        parameters=parameters,
        covariance=covariance.reshape(len(parameters), len(parameters)),
        residual=Residual(n=row["residuals"], **residual),
        log_name=Path(row["log"]).name,
        log_sha256=row["log_sha256"],
        unobservable=tuple(row["unobservable"]),
        validity=Validity(**{f.name: known.get(f.name) for f in fields(Validity)}),
        easy_axis=known["easy_axis"],
        t0_c=row["t0_c"],
    )


def write_fleet(rows: Sequence[Row], settings: Settings, path: Path) -> None:
    """Write the rows, sorted by log, whole or not at all; the same rows give the same bytes."""
    model = settings.model
    held = {k: v for k, v in asdict(model).items() if k != "path"} if model else None
    rows = sorted(rows, key=lambda row: row["log"])
    units = {name: unit for row in rows for name, unit in row.get("units", {}).items()}
    meta = {"format": FORMAT, "do": settings.do, "key": settings.key, "model": held, "units": units}
    table = _table([_flat(_named(row, settings)) for row in rows], list(units))
    sink = io.BytesIO()
    pa_parquet.write_table(table.replace_schema_metadata({META: json.dumps(meta).encode()}), sink, compression="zstd")
    write_atomic(path, sink.getvalue())


def read_fleet(path: str | Path) -> Fleet:
    """A fleet's file; while its run is not finished, what the journal beside it holds. Raises InputError."""
    path = Path(path)
    partly = journal.beside(path)
    if not path.exists() and partly.exists():
        raise InputError(must("the fleet", "one that is finished (start the same run again)", partly.name, path))
    data = read_bytes(path, "the fleet's file")
    table, meta = _table_of(data, path)
    rows = [_folded(row, meta["units"], path) for row in table.to_pylist()]
    return Fleet(rows, meta["do"], meta, path, hashlib.sha256(data).hexdigest())


def _table_of(data: bytes, path: Path) -> tuple[pa.Table, dict[str, Any]]:
    try:
        check_claims(pa_parquet.read_metadata(pa.BufferReader(data)), len(data), path)
        table = pa_parquet.read_table(pa.BufferReader(data))
        said = json.loads((table.schema.metadata or {})[META])
    except (*BAD_PARQUET, KeyError):
        raise InputError(must(WHAT, "one that `barberpole fleet` wrote", "another file", path)) from None
    meta = checked_meta(said, path)
    check_columns(table.schema, meta["units"], _type, path)
    return table, meta


def _named(row: Row, settings: Settings) -> Row:
    known = identity(Path(row["log"]), row["told"], settings.name)
    return row | asdict(known)


def _flat(row: Row) -> Row:
    """Parameters as columns of their own."""
    found = row.get("parameters") or {}
    flat = {k: v for k, v in row.items() if k not in ("parameters", "units", "told") and v is not None}
    flat["told"] = json.dumps(row["told"])
    if found:
        flat["parameters"] = list(found)
    for name, (value, error) in found.items():
        flat |= {name: value, f"{name}_stderr": error}
    return flat


def _folded(row: Row, units: dict[str, str], where: Path) -> Row:
    """A row of the file as it was in the journal, with board, lot and date. Raises InputError."""
    check_row(row, units, where)
    wide = {column for name in units for column in (name, f"{name}_stderr")}
    out = {key: value for key, value in row.items() if key not in wide and value is not None}
    names = row.get("parameters") or []
    out["told"] = _told(row["told"], where)
    if names:
        out["parameters"] = {name: [row[name], row[f"{name}_stderr"]] for name in names}
        out["units"] = {name: units[name] for name in names}
    return {"date": None, "reason": None, "log_sha256": None} | out


def _told(text: str, where: Path) -> dict[str, str]:
    try:
        told = json.loads(text)
    except (ValueError, RecursionError):
        told = None
    if not isinstance(told, dict):
        raise InputError(must(f"what a row of {WHAT} was told", "a table in JSON", "another text", where))
    return told


def _table(rows: list[Row], parameters: list[str]) -> pa.Table:
    wide = [column for name in parameters for column in (name, f"{name}_stderr")]
    others = {key for row in rows for key in row} - {*wide, *FIRST}
    columns = [*FIRST, *wide, *sorted(others)]
    return pa.table({c: pa.array([row.get(c) for row in rows], _type(c)) for c in columns})


def _type(column: str) -> pa.DataType:
    return TYPES.get(column) or (pa.string() if column in TEXT else pa.float64())


def done_before(path: Path, settings: Settings) -> dict[str, Row]:
    """Rows of a finished output that the same settings made, by the hash of their log."""
    if not path.exists():
        return {}
    try:
        fleet = read_fleet(path)
    except InputError:
        return {}
    if fleet.meta["key"] != settings.key:
        return {}
    named = ("board", "lot", "date")
    kept = [{k: v for k, v in row.items() if k not in named} for row in fleet.rows]
    return {row["log_sha256"]: row for row in kept if row["log_sha256"]}


def of_lot(fleet: Fleet, lot: str | None) -> Fleet:
    """The fleet with the rows of one lot. Raises InputError for a lot that it does not have."""
    if lot is None:
        return fleet
    rows = [row for row in fleet.rows if row["lot"] == lot]
    if not rows:
        known = ", ".join(sorted({row["lot"] for row in fleet.rows}))
        raise InputError(must("--lot", f"one of {known}", repr(lot), fleet.path))
    return replace(fleet, rows=rows)
