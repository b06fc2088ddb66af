"""Logs too long for memory: read piece by piece, as often as needed, checked as `log` checks them.

A pass yields pieces with known columns only. The first pass (`scan`) checks the whole file and keeps stretches spread
over it as a sample, an ordinary `Log`.
"""

import hashlib
import queue
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pa_parquet

from barberpole.columns import KNOWN, check_names, unknown
from barberpole.errors import InputError, must
from barberpole.frame_content import checked_meta
from barberpole.log import Log, check_size, check_state, check_time
from barberpole.log_formats import BAD_PARQUET, LONGEST_HEADER, NULLS, check_claims, header_of, meta_of, short

BIG_CSV, BIG_PARQUET = 50_000_000, 500_000  # bytes, rows: above, a log is streamed
PIECE = 1 << 16  # rows
BLOCK = 1 << 23  # bytes of CSV at a time
STRETCH, STRETCHES = 4096, 64  # rows of a stretch of the sample, and how many of them at most
AHEAD = 2  # pieces read while one is worked on
Tick = Callable[[int], None] | None


@dataclass
class LogStream:
    """A log on disk of `rows` checked rows. `sample`: stretches of it, with path, hash, notes and meta of the whole.

    t_s: first and last time. largest: the largest value of any reading column in LSB.
    """

    path: Path
    names: list[str]
    meta: dict[str, Any]
    rows: int = 0
    skipped: int = 0
    sample: Log = field(default_factory=lambda: Log({}, Path(), ""))
    t_s: tuple[float, float] | None = None
    largest: float = 0.0

    def pieces(self, dropped: list[int] | None = None) -> Iterator[dict[str, np.ndarray]]:
        """Known columns piece by piece, read ahead by a thread. Rows with a gap or without all cells are left out;
        `dropped` is told how many."""
        told: list[int] = [] if dropped is None else dropped
        source = _parquet if self.path.suffix.lower() == ".parquet" else _csv
        for piece in _ahead(source(self.path, self.names, told)):
            good = np.ones(len(next(iter(piece.values()))), bool)
            for values in piece.values():
                good &= np.isfinite(values)
            told.append(int(np.count_nonzero(~good)))
            if good.all():
                yield piece
            elif good.any():
                yield {name: values[good] for name, values in piece.items()}


def is_big(path: Path) -> bool:
    """Whether a log is to be streamed. False also of what cannot be read, for `read_log` to say why."""
    try:
        if not path.is_file():
            return False
        if path.suffix.lower() == ".parquet":
            return pa_parquet.read_metadata(path).num_rows > BIG_PARQUET
        return path.suffix.lower() == ".csv" and path.stat().st_size > BIG_CSV
    except (OSError, pa.ArrowException):
        return False


def open_stream(path: Path, tick: Tick = None) -> LogStream:
    """Scan a CSV or Parquet log. Raises InputError in one sentence as `read_log` does."""
    names, meta = _names(path)
    check_names(names, path)
    stream = LogStream(path, [name for name in names if name in KNOWN], meta)
    found: list[str] = []
    hashing = threading.Thread(target=lambda: found.append(_sha256(path)))
    hashing.start()
    stretches = _scan(stream, tick)
    hashing.join()
    notes = [f"{stream.rows} rows: read piece by piece"]
    if left := unknown(names):
        notes.append(f"columns not used: {', '.join(left)}")
    if stream.skipped:
        notes.append(f"{stream.skipped} rows were dropped for missing numbers or cells")
    columns = {name: np.concatenate([s[name] for s in stretches]) for name in stream.names}
    stream.sample = Log(columns, path, found[0], stream.skipped, tuple(notes), meta)
    return stream


def _scan(stream: LogStream, tick: Tick) -> list[dict[str, np.ndarray]]:
    """Check all rows, and return the sample: the begin of every k-th piece, k doubled when they are many."""
    stretches: list[dict[str, np.ndarray]] = []
    dropped: list[int] = []
    every, last = 1, None
    for number, piece in enumerate(stream.pieces(dropped)):
        n = len(piece[stream.names[0]])
        log = Log(piece, stream.path, "")
        if last is not None and "t_s" in piece:
            check_time(Log({"t_s": np.array([last, piece["t_s"][0]])}, stream.path, ""), stream.rows - 1)
        check_size(log, stream.rows)
        check_time(log, stream.rows)
        check_state(log, stream.rows)
        if "t_s" in piece:
            last = float(piece["t_s"][-1])
            stream.t_s = (stream.t_s[0] if stream.t_s else float(piece["t_s"][0]), last)
        stream.largest = max([stream.largest, *(float(np.max(np.abs(v))) for k, v in piece.items() if "_lsb" in k)])
        if number % every == 0:
            stretches.append({name: values[:STRETCH].copy() for name, values in piece.items()})
        if len(stretches) > STRETCHES:
            stretches, every = stretches[::2], 2 * every
        stream.rows += n
        if tick:
            tick(n)
    stream.skipped = sum(dropped)
    if not stretches:
        raise InputError(must("the log", "one with complete rows", "a gap in every row", stream.path))
    return stretches


def _names(path: Path) -> tuple[list[str], dict[str, Any]]:
    if path.suffix.lower() == ".parquet":
        try:
            claimed = pa_parquet.read_metadata(path)
            check_claims(claimed, path.stat().st_size, path)
            schema = claimed.schema.to_arrow_schema()
            return list(schema.names), checked_meta(meta_of(schema), path)
        except BAD_PARQUET as error:
            raise InputError(must("the log", "a Parquet file", short(error), path)) from None
    with path.open("rb") as file:
        return header_of(file.read(LONGEST_HEADER + 1), path)[0], {}


def _parquet(path: Path, names: list[str], dropped: list[int]) -> Iterator[dict[str, np.ndarray]]:
    try:
        with pa_parquet.ParquetFile(path, pre_buffer=False) as file:
            for batch in file.iter_batches(PIECE, columns=names):
                yield _floats(batch, path)
    except BAD_PARQUET as error:
        raise InputError(must("the log", "a Parquet file", short(error), path)) from None


def _csv(path: Path, names: list[str], dropped: list[int]) -> Iterator[dict[str, np.ndarray]]:
    types = dict.fromkeys(names, pa.float64())
    convert = pa_csv.ConvertOptions(column_types=types, include_columns=names, null_values=NULLS)
    with path.open("rb") as file:
        listed, above = header_of(file.read(LONGEST_HEADER + 1), path)
    parse = pa_csv.ParseOptions(invalid_row_handler=lambda row: dropped.append(1) or "skip")
    read = pa_csv.ReadOptions(block_size=BLOCK, skip_rows=above, column_names=listed)
    try:
        with pa_csv.open_csv(path, read, parse, convert) as reader:
            for batch in reader:
                for at in range(0, batch.num_rows, PIECE):
                    yield _floats(batch.slice(at, PIECE), path)
    except pa.ArrowInvalid as error:
        raise InputError(must("the log", "comma-separated numbers under a line of names", short(error), path)) from None


def _floats(batch: pa.RecordBatch, path: Path) -> dict[str, np.ndarray]:
    try:
        cast = {
            name: values.cast(pa.float64(), safe=False)
            for name, values in zip(batch.schema.names, batch.columns, strict=True)
        }
    except pa.ArrowException as error:
        raise InputError(must("known columns", "numbers", short(error), path)) from None
    return {name: values.to_numpy(zero_copy_only=False) for name, values in cast.items()}


def _ahead(source: Iterator[dict[str, np.ndarray]]) -> Iterator[dict[str, np.ndarray]]:
    """The same items, read by another thread a little ahead. What it raises is raised here."""
    waiting: queue.Queue[Any] = queue.Queue(AHEAD)
    stopped = threading.Event()

    def put(item: Any) -> bool:
        while not stopped.is_set():
            try:
                waiting.put(item, timeout=0.1)
                return True
            except queue.Full:
                continue
        return False

    def read() -> None:
        try:
            for item in source:
                if not put(item):
                    return
            put(None)
        except Exception as error:  # noqa: BLE001  (raised again by whoever takes it)
            put(error)

    thread = threading.Thread(target=read, daemon=True)
    thread.start()
    try:
        while (item := waiting.get()) is not None:
            if isinstance(item, Exception):
                raise item
            yield item
    finally:
        stopped.set()
        thread.join()


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
