"""What is done so far, beside the output: one JSON line a log, appended as it comes, so that a crash loses nothing.

A line that a crash cut short is not read. The file is locked while a run writes it, and goes when the output is there.
"""

import contextlib
import fcntl
import json
import os
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from barberpole.errors import InputError, must
from barberpole.files import cannot_write

Row = dict[str, Any]
SYNC_S = 1.0  # a power cut loses no more than this


class Journal:
    """Rows by log hash, for one key (`Settings.key`). A context manager."""

    def __init__(self, output: Path, key: str):
        self.path, self.key = beside(output), key
        self.done: dict[str, Row] = {}
        self._synced = time.monotonic()

    def __enter__(self) -> "Journal":
        try:
            self._file = self.path.open("ab")
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            got = "one that another run is writing"
            raise InputError(must("the output", "a file of this run alone", got, self.path)) from None
        except OSError as error:
            raise cannot_write("the output", error, self.path) from None
        self.done = {row["log_sha256"]: row for row in rows_of(self.path, self.key) if row["log_sha256"]}
        self._file.write(b"\n" if self.path.stat().st_size else b"")  # ends a line that was cut short
        return self

    def __exit__(self, *_error) -> None:
        with contextlib.suppress(OSError):  # a full disk was said by `add`
            self._file.close()
        if self.path.exists() and not self.path.stat().st_size:
            self.path.unlink()

    def add(self, rows: Iterable[Row]) -> None:
        """Append rows and hand them to the system at once. Raises InputError where the disk is full."""
        lines = [json.dumps({"key": self.key, "row": row}) + "\n" for row in rows]
        try:
            self._file.write("".join(lines).encode())
            self._file.flush()
        except OSError as error:
            raise cannot_write("the journal", error, self.path) from None
        if time.monotonic() - self._synced > SYNC_S:
            os.fsync(self._file.fileno())
            self._synced = time.monotonic()

    def finish(self) -> None:
        """The output holds it all now."""
        self.path.unlink(missing_ok=True)


def beside(output: Path) -> Path:
    """The journal of an output."""
    return output.with_name(output.name + ".part")


def rows_of(path: Path, key: str | None = None) -> list[Row]:
    """Rows of a journal, whole lines only; those of one key, or of the key that was used last."""
    entries = []
    for line in path.read_bytes().splitlines() if path.exists() else []:
        try:
            entries.append(json.loads(line))
        except ValueError:
            continue
    key = key or (entries[-1]["key"] if entries else None)
    return [entry["row"] for entry in entries if entry["key"] == key]
