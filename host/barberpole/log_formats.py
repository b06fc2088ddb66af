"""CSV and Parquet as columns of floats, and back: read fast by pyarrow, judged cell by cell only where it fails."""

import codecs
import csv
import io
import json
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pa_parquet

from barberpole.columns import KNOWN, OTHER_TABLES, check_names
from barberpole.errors import InputError, must

Columns = dict[str, np.ndarray]

NULLS = ["", "nan", "NaN", "NAN", "NA", "N/A", "null", "None"]
MOST_NUMBERS = 500_000_000  # 4 GB
# A small Parquet file may claim any number of equal rows; measured ones take more room than this.
FEW_NUMBERS, NUMBERS_A_BYTE = 20_000_000, 25
LONGEST_HEADER = 1 << 20  # bytes of a CSV's first line
BOM = b"\xef\xbb\xbf"
THREADS_FROM = 1 << 20  # bytes; below, starting threads takes longer than reading
LINE_END = re.compile(rb"\r\n?|\n")
_META = b"barberpole"
BAD_PARQUET = (ValueError, OSError, pa.ArrowException, RecursionError)  # the last: brackets in the metadata


def read_csv(data: bytes, where: object, readings: bool = True) -> tuple[Columns, list[str], int]:
    """Columns of a comma-separated file with names in its first line, but for lines that begin with #: columns (NaN
    where empty), notes, rows dropped.

    readings: whether there must be columns x_lsb.. (of an array they begin with the sensor's name).
    Raises InputError about the names, or about a cell of a known column that is no number, with its row.
    """
    names, above = header_of(data, where)
    check_names(names, where, readings)
    dropped: list[Any] = []
    parse = pa_csv.ParseOptions(invalid_row_handler=lambda row: dropped.append(row.number) or "skip")
    convert = pa_csv.ConvertOptions(null_values=NULLS, strings_can_be_null=True, true_values=[], false_values=[])
    read = pa_csv.ReadOptions(skip_rows=above, column_names=names, use_threads=len(data) > THREADS_FROM)
    try:
        table = pa_csv.read_csv(io.BytesIO(_as_utf8(data)), read, parse, convert)
    except pa.ArrowInvalid as error:
        wanted = "comma-separated rows under a line of names"
        raise InputError(must("the log", wanted, short(error), where)) from None
    notes = [f"{len(dropped)} rows without {len(names)} cells were dropped"] if dropped else []
    return _floats(table, notes, where), notes, len(dropped)


def read_parquet(data: bytes, where: object, readings: bool = True) -> tuple[Columns, list[str], dict[str, Any]]:
    """Columns of a Parquet file, notes, and the metadata that `write_parquet` put there."""
    try:
        claimed = pa_parquet.read_metadata(pa.BufferReader(data))
        check_claims(claimed, len(data), where)
        if claimed.num_rows * claimed.num_columns > MOST_NUMBERS:
            got = f"{claimed.num_rows} rows of {claimed.num_columns} columns"
            raise InputError(must("the log", f"of at most {MOST_NUMBERS:g} numbers to be read whole", got, where))
        table = pa_parquet.read_table(pa.BufferReader(data), use_threads=len(data) > THREADS_FROM)
        meta = meta_of(table.schema)
    except BAD_PARQUET as error:
        raise InputError(must("the log", "a Parquet file", short(error), where)) from None
    check_names(table.column_names, where, readings)
    notes: list[str] = []
    return _floats(table, notes, where), notes, meta


def check_claims(claimed: pa_parquet.FileMetaData, size: int, where: object) -> None:
    """Raise InputError where a Parquet file of `size` bytes claims to hold more than its size can."""
    parts = [claimed.row_group(at) for at in range(claimed.num_row_groups)]
    unpacked = max([claimed.num_rows * claimed.num_columns, *(part.total_byte_size // 8 for part in parts)])
    if claimed.num_rows < 0 or unpacked > max(FEW_NUMBERS, NUMBERS_A_BYTE * size):
        got = f"{claimed.num_rows} rows of {claimed.num_columns} columns in {size} bytes"
        raise InputError(must("the log", "a Parquet file of measured rows", got, where))


def write_csv(columns: Columns) -> bytes:
    """The file's bytes; every float comes back exactly."""
    sink = io.BytesIO()
    pa_csv.write_csv(pa.table(columns), sink, pa_csv.WriteOptions(quoting_style="needed"))
    return sink.getvalue()


def write_parquet(columns: Columns, meta: dict[str, Any]) -> bytes:
    """The file's bytes, with `meta` as JSON in its schema."""
    sink = io.BytesIO()
    table = pa.table(columns).replace_schema_metadata({_META: json.dumps(meta).encode()})
    pa_parquet.write_table(table, sink)
    return sink.getvalue()


def meta_of(schema: pa.Schema) -> dict[str, Any]:
    """The metadata that `write_parquet` put into a file."""
    return json.loads((schema.metadata or {}).get(_META, b"{}"))


def header_of(data: bytes, where: object) -> tuple[list[str], int]:
    """The column names of a CSV, in its first line or below remarks that begin with #, and how many lines the rows
    stand below. Raises InputError where there are none."""
    lines = []
    for line in _lines(data[: LONGEST_HEADER + 1]):
        lines.append(line)
        if not line.removeprefix(BOM).startswith(b"#"):
            break
    at = len(lines) - 1
    if at and (not lines[at].strip() or _begins_rows(lines[at])):
        at -= 1  # numpy.savetxt writes its names so
    if sum(map(len, lines[: at + 1])) + at > LONGEST_HEADER:
        got = "a longer one"
        raise InputError(must("the log's first line", f"of at most {LONGEST_HEADER} characters", got, where))
    return _names(lines[at], where), at + 1


def _lines(data: bytes) -> Iterator[bytes]:
    start = 0
    for end in LINE_END.finditer(data):
        yield data[start : end.start()]
        start = end.end()
    yield data[start:]


def _begins_rows(line: bytes) -> bool:
    return all(_number(cell) is not None for cell in line.decode(errors="replace").split(","))


def _names(first: bytes, where: object) -> list[str]:
    if not first.strip():
        raise InputError(must("the log", "a line of column names and rows under it", "an empty first line", where))
    try:
        line = first.decode("utf-8-sig")
    except UnicodeDecodeError:
        got = "UTF-16" if first.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else "other bytes"
        raise InputError(must("the log's first line", "column names in UTF-8", got, where)) from None
    marked = line.startswith("#")
    try:
        names = [name.strip() for name in next(csv.reader([line.lstrip("# ")]), [])]
    except csv.Error as error:  # a name of more characters than anybody writes
        raise InputError(must("the log's first line", "column names", error, where)) from None
    if len(names) == 1 and any(mark in line for mark in ";\t"):
        raise InputError(must("the log's columns", "separated by commas", f"{line[:40]!r}; {OTHER_TABLES}", where))
    if (marked and len(names) < 2) or all(_number(name) is not None for name in names):
        raise InputError(must("the log's first line", "column names such as x_lsb", repr(line[:40]), where))
    return names


def _as_utf8(data: bytes) -> bytes:
    """Damaged bytes replaced by a mark, so that the cell they are in can be shown."""
    try:
        data.decode()
    except UnicodeDecodeError:
        return data.decode(errors="replace").encode()
    return data


def _floats(table: pa.Table, notes: list[str], where: object) -> Columns:
    """float64 columns; unknown ones that hold text are left out, with a note."""
    columns = {}
    for name, values in zip(table.column_names, table.columns, strict=True):
        numbers = _numbers(values)
        if numbers is None and name in KNOWN:
            row, cell = _first_text(values)
            way = f"; {OTHER_TABLES}, times as text too" if name == "t_s" else ""
            raise InputError(must(f"column {name}", "numbers", f"{cell!r} in row {row + 1}{way}", where))
        if numbers is None:
            notes.append(f"column {name} holds text and was left out")
        else:
            columns[name] = numbers
    return columns


def _numbers(values: pa.ChunkedArray) -> np.ndarray | None:
    if pa.types.is_null(values.type):
        return np.full(len(values), np.nan)
    if pa.types.is_integer(values.type) or pa.types.is_floating(values.type):
        return values.cast(pa.float64(), safe=False).to_numpy().astype(np.float64)
    cells = [_number(cell) for cell in values.to_pylist()]
    return None if None in cells else np.array(cells, float)


def _number(cell: Any) -> float | None:
    """The cell as a float, NaN where empty, None where it is no number."""
    if cell is None:
        return float("nan")
    try:
        return float(cell)
    except (TypeError, ValueError):
        return None


def _first_text(values: pa.ChunkedArray) -> tuple[int, str]:
    for row, cell in enumerate(values.to_pylist()):
        if _number(cell) is None:
            return row, str(cell)
    return 0, ""


def short(error: Exception) -> str:
    """The first line of an error."""
    return next(iter(str(error).splitlines()), type(error).__name__)[:120]
