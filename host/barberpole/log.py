"""Logs: CSV, Parquet and the board's framed records, checked once, here.

One row a sample; names carry units (`barberpole.columns`). Rows with a NaN in a known column are dropped, counted and
noted; columns that are not known are kept and noted. Everything else that is wrong is an InputError.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from barberpole import columns as names_of
from barberpole.board_log import SelfcalRun, read_board_log
from barberpole.columns import KNOWN, READINGS, RESET, SET
from barberpole.errors import InputError, must
from barberpole.files import read_bytes, write_atomic
from barberpole.frame_content import LARGEST, checked_meta
from barberpole.log_formats import read_csv, read_parquet, write_csv, write_parquet
from barberpole.polarity import pairs_are_raw

ROLE_COMMANDS = {
    "coil_driver": "a coil driver (`barberpole imcs` takes it)",
    "array": "an array (`barberpole array` takes it)",
}
SUFFIXES = (".csv", ".parquet", ".bpr")


@dataclass(frozen=True, eq=False)
class Log:
    """A checked log of n rows.

    columns     name -> (n,) float64, in file order
    sha256      of the file; path names it
    skipped     damaged records and dropped rows; notes say in sentences what was dropped and why
    meta        the board record's header: board, sensor, model, calibration and so on
    selfcal     the self-calibration found among board records
    """

    columns: dict[str, np.ndarray]
    path: Path
    sha256: str
    skipped: int = 0
    notes: tuple[str, ...] = ()
    meta: dict[str, Any] = field(default_factory=dict)
    selfcal: SelfcalRun | None = None

    @property
    def n(self) -> int:
        """Rows."""
        return len(next(iter(self.columns.values())))

    def has(self, *names: str) -> bool:
        """Whether all of these columns are there."""
        return all(name in self.columns for name in names)

    def __getitem__(self, name: str) -> np.ndarray:
        """A column (n,). Raises InputError if the log does not have it."""
        if name not in self.columns:
            raise InputError(must("the log", f"one with a column {name}", ", ".join(self.columns), self.path))
        return self.columns[name]

    def get(self, name: str) -> np.ndarray | None:
        """A column (n,), None if the log does not have it."""
        return self.columns.get(name)

    def stack(self, names: tuple[str, ...]) -> np.ndarray | None:
        """Columns as one array (len(names), n), None unless all are there."""
        return np.stack([self.columns[name] for name in names]) if self.has(*names) else None

    def take(self, rows: slice | np.ndarray) -> "Log":
        """The same log with a selection of its rows."""
        return replace(self, columns={name: values[rows] for name, values in self.columns.items()})


def read_log(path: str | Path) -> Log:
    """Read and check a log. Raises InputError in one sentence: what, where, what was expected."""
    path = Path(path)
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        got = f"{path.suffix!r}; {names_of.OTHER_TABLES}"
        raise InputError(must("the log", f"a file that ends in {', '.join(SUFFIXES)}", got, path))
    data = read_bytes(path, "the log")
    if not data:
        raise InputError(must("the log", "a file with rows", "an empty file", path))
    return checked(reader(data, path))


def write_log(log: Log, path: str | Path) -> None:
    """Write the columns as CSV or Parquet, whole or not at all. Raises InputError for another ending."""
    path = Path(path)
    if path.suffix.lower() == ".parquet":
        write_atomic(path, write_parquet(log.columns, log.meta))
    elif path.suffix.lower() == ".csv":
        write_atomic(path, write_csv(log.columns))
    else:
        raise InputError(must("the log to write", "a file that ends in .csv or .parquet", repr(path.suffix), path))


def _from_csv(data: bytes, path: Path) -> Log:
    columns, notes, dropped = read_csv(data, path)
    return Log(columns, path, file_sha256(data), dropped, tuple(notes))


def _from_parquet(data: bytes, path: Path) -> Log:
    columns, notes, meta = read_parquet(data, path)
    return Log(columns, path, file_sha256(data), 0, tuple(notes), checked_meta(meta, path))


def _from_records(data: bytes, path: Path) -> Log:
    found = read_board_log(data, path)
    role = found.meta.get("role", "sensor")
    if role in ROLE_COMMANDS:
        got = f"the record of {ROLE_COMMANDS[role]}"
        raise InputError(must("the log", "one of a single sensor", got, path))
    return Log(found.columns, path, file_sha256(data), found.skipped, found.notes, found.meta, found.selfcal)


_READERS: dict[str, Callable[[bytes, Path], Log]] = {
    ".csv": _from_csv,
    ".parquet": _from_parquet,
    ".bpr": _from_records,
}


def file_sha256(data: bytes) -> str:
    """Hash of a file's bytes in hex digits."""
    return hashlib.sha256(data).hexdigest()


def checked(log: Log) -> Log:
    """A log in the contract: complete rows, times that do not go back, x_lsb.. beside pairs. Raises InputError."""
    if log.n == 0:
        raise InputError(must("the log", "one with rows", "only column names", log.path))
    log = _without_nan(log)
    check_size(log)
    check_time(log)
    check_state(log)
    extra = names_of.unknown(log.columns)
    if extra:
        log = _noted(log, f"columns kept but not used: {', '.join(extra)}")
    return _with_demodulated(log)


def _noted(log: Log, note: str) -> Log:
    return replace(log, notes=(*log.notes, note))


def _without_nan(log: Log) -> Log:
    """Rows where every known column is finite. An all-NaN column is an error: dropping it would drop everything."""
    bad = {name: ~np.isfinite(values) for name, values in log.columns.items() if name in KNOWN}
    for name, rows in bad.items():
        if rows.all():
            raise InputError(must(f"column {name}", "numbers", "no number in any row", log.path))
    worst = np.any(list(bad.values()), axis=0)
    if not worst.any():
        return log
    if worst.all():
        raise InputError(must("the log", "one with complete rows", "a gap in every row", log.path))
    where = ", ".join(f"{name} {int(rows.sum())}" for name, rows in bad.items() if rows.any())
    kept = replace(log.take(~worst), skipped=log.skipped + int(worst.sum()))
    return _noted(kept, f"{int(worst.sum())} of {log.n} rows were dropped for missing numbers ({where})")


def check_time(log: Log, before: int = 0) -> None:
    """Raise InputError where time goes back. `before` rows of the file came before these."""
    if log.has("t_s") and np.any(back := np.diff(log["t_s"]) < 0):
        row = int(np.argmax(back)) + 1
        got = f"{log['t_s'][row]:.9g} after {log['t_s'][row - 1]:.9g} in row {before + row + 1}"
        raise InputError(must("column t_s", "times that do not go back", got, log.path))


def check_size(log: Log, before: int = 0) -> None:
    """Raise InputError where a known column holds what is no measured quantity: its square would end in infinity."""
    for name, values in log.columns.items():
        if name in KNOWN and values.size and max(values.max(), -values.min()) > LARGEST:
            row = int(np.argmax(np.abs(values)))
            got = f"{values[row]:.9g} in row {before + row + 1}"
            raise InputError(must(f"column {name}", f"of at most {LARGEST:g}", got, log.path))


def check_state(log: Log, before: int = 0) -> None:
    """Raise InputError where the state is none."""
    if log.has("state") and not np.all(known := np.isin(log["state"], (-1, 0, 1))):
        row = int(np.argmin(known))
        got = f"{log['state'][row]:g} in row {before + row + 1}"
        raise InputError(must("column state", "+1 (SET), -1 (RESET) or 0 (demodulated)", got, log.path))


def _with_demodulated(log: Log) -> Log:
    """x_lsb.. from SET and RESET where the log does not carry them."""
    set_lsb, reset_lsb = log.stack(SET), log.stack(RESET)
    if set_lsb is None or reset_lsb is None or log.has(*READINGS):
        return log
    sign = -1.0 if resets_are_raw(log) else 1.0
    demodulated = dict(zip(READINGS, (set_lsb + sign * reset_lsb) / 2, strict=True))
    return replace(log, columns={**log.columns, **demodulated})


def resets_are_raw(log: Log) -> bool:
    """Whether the RESET columns carry the reversed sign: known of board records, decided from the data otherwise."""
    set_lsb, reset_lsb = (np.stack([log[name] for name in names]) for names in (SET, RESET))
    return log.meta.get("polarity") == "raw" or pairs_are_raw(set_lsb, reset_lsb)
