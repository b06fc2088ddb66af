"""Tables that other programs wrote, as logs: whoever knows what their columns hold says so, nothing is guessed.

Semicolons, tabs or blanks between the cells, decimal commas, times as text and other units are read; what a column
means is taken from `NAME=COLUMN` or `NAME=COLUMN:UNIT`, NAME being one of the log's (`barberpole.columns`).
"""

import csv
import re
from collections.abc import Iterable, Sequence
from datetime import datetime
from pathlib import Path

import numpy as np

from barberpole.columns import KNOWN, check_names, listed
from barberpole.errors import InputError, must
from barberpole.files import read_bytes
from barberpole.log import Log, checked, file_sha256
from barberpole.units import other_unit, unit_of

SEPARATORS = ";\t,"  # the first of them that the line of names holds; blanks where it holds none
DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")
CLOCKS = ("%d.%m.%Y %H:%M:%S.%f", "%d.%m.%Y %H:%M:%S", "%H:%M:%S.%f", "%H:%M:%S")  # beside ISO 8601
STATES = {"set": 1.0, "s": 1.0, "+": 1.0, "reset": -1.0, "r": -1.0, "-": -1.0}
EMPTY = ("", "nan", "na", "n/a", "null", "none")


def read_foreign(path: str | Path, taken: Sequence[str]) -> Log:
    """The columns `taken` of a text table as a checked log; times as text become seconds from the first row.

    Raises InputError where a name is none of a log's, a column is not there, or a cell is not what it must be.
    """
    path = Path(path)
    data = read_bytes(path, "the table")
    names, rows = _table(data, path)
    columns, used = {}, set()
    for name, column, unit in (_parsed(one, names) for one in taken):
        if name in columns:
            raise InputError(must(f"column {name}", "taken once", "it twice"))
        if column not in names:
            got = f"{column!r}; there are {listed(names)}"
            raise InputError(must(f"what is taken as {name}", "a column of the table", got, path))
        cells = [row[names.index(column)] for row in rows]
        columns[name] = other_unit(_values(name, column, cells, path), name, unit)
        used.add(column)
    check_names(list(columns), path)
    left = [name for name in names if name not in used]
    notes = (f"columns left out: {listed(left)}",) if left else ()
    return checked(Log(columns, path, file_sha256(data), notes=notes))


def _parsed(taken: str, names: Sequence[str]) -> tuple[str, str, str]:
    """Name, column and unit ("" where it is the log's own) of one NAME=COLUMN[:UNIT]."""
    name, equals, column = taken.partition("=")
    if not equals or not column:
        raise InputError(must("--take", "NAME=COLUMN or NAME=COLUMN:UNIT, such as x_lsb=mx", repr(taken)))
    if name not in KNOWN:
        raise InputError(must("the name before = in --take", f"one of {', '.join(sorted(KNOWN))}", repr(name)))
    head, colon, unit = column.rpartition(":")
    plain = column in names or not (colon and head)  # a name may hold a colon itself
    return (name, column, "") if plain else (name, head, unit_of(unit, name))


def _table(data: bytes, path: Path) -> tuple[list[str], list[list[str]]]:
    """Column names, and the cells of each row that has as many."""
    try:
        lines = [line for line in data.decode("utf-8-sig").splitlines() if line.strip()]
    except UnicodeDecodeError:
        lines = [line for line in data.decode("latin-1").splitlines() if line.strip()]
    if len(lines) < 2:
        raise InputError(must("the table", "a line of column names and rows under it", f"{len(lines)} lines", path))
    lines[0] = lines[0].lstrip("# ")
    separator = next((mark for mark in SEPARATORS if mark in lines[0]), None)
    cells = csv.reader(lines, delimiter=separator) if separator else (line.split() for line in lines)
    try:
        names, *rows = [[cell.strip() for cell in row] for row in cells]
    except csv.Error as error:  # a cell of more characters than anybody writes
        raise InputError(must("the table", "of cells", str(error), path)) from None
    for number, row in enumerate(rows, start=1):
        if len(row) != len(names):
            raise InputError(must(f"row {number}", f"{len(names)} cells wide, as its names", len(row), path))
    return names, rows


def _values(name: str, column: str, cells: list[str], path: Path) -> np.ndarray:
    """(n,) numbers of a column; NaN where a cell is empty."""
    if name == "state":
        cells = [str(STATES.get(cell.lower(), cell)) for cell in cells]
    elif name == "t_s" and (seconds := _seconds(cells)) is not None:
        return seconds
    out = np.full(len(cells), np.nan)
    for row, cell in enumerate(cells):
        try:
            out[row] = np.nan if cell.lower() in EMPTY else float(_with_point(cell))
        except ValueError:
            wanted = "times or numbers of seconds" if name == "t_s" else "numbers"
            raise InputError(must(f"column {column}", wanted, f"{cell!r} in row {row + 1}", path)) from None
    return out


def _with_point(cell: str) -> str:
    return cell.replace(",", ".") if DECIMAL_COMMA.fullmatch(cell) else cell


def _seconds(cells: Iterable[str]) -> np.ndarray | None:
    """Seconds from the first of times as text; None where they are not all of one form."""
    cells = list(cells)
    for read in (datetime.fromisoformat, *(_reader(form) for form in CLOCKS)):
        try:
            times = [read(cell) for cell in cells]
            return np.array([(time - times[0]).total_seconds() for time in times])
        except (ValueError, TypeError):  # another form, or some with and some without their zone
            continue
    return None


def _reader(form: str):
    return lambda cell: datetime.strptime(cell, form)
