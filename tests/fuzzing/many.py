"""Good files of several sensors: an array's logs and calibration, a fleet's table."""

import io
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pa_parquet
from barberpole.cli import run
from barberpole.columns import FIELD
from barberpole.fleet.pool import Pool
from barberpole.fleet.run import logs
from barberpole.fleet.run import run as run_fleet
from barberpole.fleet.settings import settings_of
from barberpole.fleet.table import META
from barberpole.modelfile import read_model

from fuzzing.one import turned

ROWS = 200
BOARDS = 4
HERE = Pool(partial(ThreadPoolExecutor, 1), lambda executor: executor.shutdown(), 1)


def write_array(folder: Path) -> None:
    """array-turned.csv, array-run.csv and array-seen.csv, short, and the calibration array.toml."""
    run(["array", "simulate", "-o", str(folder / "whole")])
    for name in ("turned", "run", "seen"):
        lines = (folder / "whole" / f"{name}.csv").read_text().splitlines(keepends=True)
        step = 1 if name == "run" else len(lines) // ROWS
        (folder / f"array-{name}.csv").write_text("".join([lines[0], *lines[1::step]]))
    of = [str(folder / f"array-{name}.csv") for name in ("turned", "run")]
    run(["array", "calibrate", of[0], "--run", of[1], "-o", str(folder / "array.toml")])


def write_fleet(folder: Path, model: str) -> bytes:
    """fleet.parquet of a few boards; the JSON in its schema."""
    lot = folder / "lot"
    lot.mkdir()
    for at in range(BOARDS):
        columns, field = turned(10 + at)
        pa_parquet.write_table(pa.table(columns | dict(zip(FIELD, field, strict=True))), lot / f"board{at}.parquet")
    path = folder / "fleet.parquet"
    run_fleet(logs([str(lot)]), settings_of("fit", read_model(model)), path, HERE)
    return pa_parquet.read_schema(path).metadata[META]


def with_meta(path: Path) -> Callable[[bytes], bytes]:
    """The table with another text in its schema."""
    table = pa_parquet.read_table(path)

    def made(meta: bytes) -> bytes:
        sink = io.BytesIO()
        pa_parquet.write_table(table.replace_schema_metadata({META: meta}), sink)
        return sink.getvalue()

    return made
