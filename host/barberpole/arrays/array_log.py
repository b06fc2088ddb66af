"""The log of an array: columns of one sensor begin with its name, the others belong to all.

    t_s, a_x_lsb, a_y_lsb, a_z_lsb, b_x_lsb, b_y_lsb, b_z_lsb, ix_ma, iy_ma, iz_ma, temp_c

Read as one log a sensor, each in the log contract and checked by it: whatever takes a log takes each of them. A row
that one sensor lacks is left out of all, so that rows stay side by side.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from barberpole.arrays.array_file import Array
from barberpole.board_log import read_board_log
from barberpole.columns import READINGS, RESET, SET
from barberpole.errors import InputError, must
from barberpole.files import read_bytes
from barberpole.frame_content import checked_meta
from barberpole.log import Log, checked, file_sha256
from barberpole.log_formats import read_csv, read_parquet

OF_ONE = (*READINGS, *SET, *RESET, "temp_c", "bx_ut", "by_ut", "bz_ut", "cx_ut", "cy_ut", "cz_ut")


def read_array_log(path: str | Path, array: Array) -> dict[str, Log]:
    """One log a sensor, by its name; all of as many rows. Raises InputError where a sensor has no readings."""
    path = Path(path)
    data = read_bytes(path, "the array's log")
    columns, notes, skipped, meta = _columns(data, path)
    logs = {name: _of(name, array, columns, path, file_sha256(data)) for name in array.names}
    for name, log in logs.items():
        empty = [column for column, values in log.columns.items() if not np.any(np.isfinite(values))]
        if empty:
            got = f"no number in {', '.join(empty)}"
            raise InputError(must(f"the array's log of the sensor {name}", "one with readings", got, path))
    whole = np.all([np.all([np.isfinite(v) for v in log.columns.values()], axis=0) for log in logs.values()], axis=0)
    if not whole.any():
        raise InputError(must("the array's log", "one with complete rows", "a gap in every row", path))
    lost = int(np.sum(~whole))
    if lost:
        notes = (*notes, f"{lost} of {whole.size} rows were dropped for missing numbers")
    made = {n: replace(log.take(whole), notes=notes, skipped=skipped + lost, meta=meta) for n, log in logs.items()}
    return {name: checked(log) for name, log in made.items()}


def _columns(data: bytes, path: Path) -> tuple[dict[str, np.ndarray], tuple[str, ...], int, dict]:
    suffix = path.suffix.lower()
    if suffix == ".csv":
        columns, notes, dropped = read_csv(data, path, readings=False)
        return columns, tuple(notes), dropped, {}
    if suffix == ".parquet":
        columns, notes, meta = read_parquet(data, path, readings=False)
        return columns, tuple(notes), 0, checked_meta(meta, path)
    if suffix == ".bpr":
        found = read_board_log(data, path)
        return found.columns, found.notes, found.skipped, found.meta
    raise InputError(must("the array's log", "a file that ends in .csv, .parquet or .bpr", repr(path.suffix), path))


def _of(name: str, array: Array, columns: dict[str, np.ndarray], path: Path, sha256: str) -> Log:
    """The columns of one sensor and those of all."""
    own = {column.removeprefix(f"{name}_"): v for column, v in columns.items() if _owner(column, array) == name}
    shared = {column: v for column, v in columns.items() if _owner(column, array) is None and column not in own}
    if not (set(READINGS) <= set(own) or {*SET, *RESET} <= set(own)):
        wanted = f"one with {', '.join(f'{name}_{column}' for column in READINGS)}"
        raise InputError(must("the array's log", wanted, f"columns {', '.join(columns)}", path))
    return Log({**shared, **own}, path, sha256)


def _owner(column: str, array: Array) -> str | None:
    """The sensor that a column belongs to, None where it belongs to all."""
    first, _, rest = column.partition("_")
    return first if first in array.names and rest in OF_ONE else None
