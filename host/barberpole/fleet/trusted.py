"""A fleet's file comes from a disk, perhaps another's: what it holds is checked here before anything counts on it."""

from collections.abc import Callable
from typing import Any, Literal

import pyarrow as pa
from pydantic.dataclasses import dataclass

from barberpole.errors import InputError, must
from barberpole.tables import STRICT, Integer, validate

FORMAT = 1
WHAT = "the fleet's file"
PLAIN = ("log", "board", "lot", "status", "told")  # text in every row
FITTED = ("reference", "rms_lsb", "t0_c", "residuals", "easy_axis", "covariance", "unobservable")  # beside parameters


@dataclass(frozen=True, config=STRICT)
class _Model:
    effects: tuple[str, ...]
    settings: dict[str, dict[str, Any]]
    reference: dict[str, Any]
    plugins: tuple[str, ...]
    sensor: str | None


@dataclass(frozen=True, config=STRICT)
class _Meta:
    format: Integer
    do: Literal["fit", "verify", "diagnose"]
    key: str
    model: _Model | None
    units: dict[str, str]


def checked_meta(meta: Any, where: object) -> dict[str, Any]:
    """What the file says of its making. Raises InputError."""
    if not isinstance(meta, dict) or meta.get("format") != FORMAT:
        got = f"format {meta.get('format')}" if isinstance(meta, dict) else type(meta).__name__
        raise InputError(must(WHAT, f"of format {FORMAT}", got, where))
    validate(_Meta, meta, WHAT, where)
    return meta


def check_columns(schema: pa.Schema, units: dict[str, str], kind: Callable[[str], pa.DataType], where: object) -> None:
    """Raise InputError where a column is absent, or of another type than was written."""
    wide = {column for name in units for column in (name, f"{name}_stderr")}
    for name in (*PLAIN, *wide, *(FITTED if units else ())):
        if name not in schema.names:
            raise InputError(must(WHAT, f"one with a column {name}", "none", where))
    for field in schema:
        wanted = pa.float64() if field.name in wide else kind(field.name)
        if field.type != wanted and not pa.types.is_null(field.type):
            raise InputError(must(f"column {field.name} of {WHAT}", f"of {wanted}", field.type, where))


def check_row(row: dict[str, Any], units: dict[str, str], where: object) -> None:
    """Raise InputError where a row lacks what every row has, or what one with parameters has."""
    names = row.get("parameters") or []
    lacking = [name for name in PLAIN if row.get(name) is None]
    lacking += [name for name in FITTED if names and row.get(name) is None]
    if lacking:
        raise InputError(must(f"a row of {WHAT}", f"one with {lacking[0]}", "nothing", where))
    if strange := [name for name in names if name not in units]:
        raise InputError(must(f"the parameters of {WHAT}", "such as have a unit", repr(strange[0]), where))
    if names and (len(row["covariance"]) != len(names) ** 2 or len(row["easy_axis"]) != 3 or row["residuals"] < 1):
        raise InputError(must(f"a row of {WHAT}", "with a covariance of its parameters", "another shape", where))
