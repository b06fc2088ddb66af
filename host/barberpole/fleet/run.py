"""A run over many logs: what is done already is kept, the rest is done, each row is in the journal as it comes."""

import glob
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from barberpole.errors import InputError, must
from barberpole.fleet.journal import Journal, Row
from barberpole.fleet.pool import Pool, each
from barberpole.fleet.settings import Settings
from barberpole.fleet.table import done_before, write_fleet
from barberpole.fleet.work import lost, sha256, work
from barberpole.log import SUFFIXES

CHUNK = {"fit": 8, "verify": 8, "diagnose": 1}  # logs handed over at a time: some tenths of a second of work


@dataclass(frozen=True)
class Summary:
    """How a run went. known: logs whose rows were there already; seconds of this run, for the others."""

    rows: list[Row]
    known: int
    seconds: float

    @property
    def failed(self) -> list[Row]:
        return [row for row in self.rows if row["status"] != "ok"]

    @property
    def rate(self) -> float:
        """Logs done a second."""
        return (len(self.rows) - self.known) / max(self.seconds, 1e-9)


def logs(patterns: Sequence[str]) -> list[str]:
    """The logs that files, folders or globs (** too) name, sorted. Raises InputError if there are none."""
    found: set[str] = set()
    for pattern in patterns:
        path = Path(pattern)
        if path.is_dir():
            found |= {str(p) for p in path.rglob("*") if p.suffix.lower() in SUFFIXES}
        else:
            found |= {p for p in glob.glob(pattern, recursive=True) if Path(p).is_file()}  # noqa: PTH207 (absolute too)
            if path.suffix and not glob.has_magic(pattern):
                found.add(pattern)  # a file that is not there is a row with its reason
    if not found:
        raise InputError(must("the logs", "files that are there", f"none for {', '.join(patterns)}"))
    return sorted(found)


def run(
    paths: Sequence[str], settings: Settings, output: Path, pool: Pool, tick: Callable[[int], None] = lambda _: None
) -> Summary:
    """Do every log and write the table. Interrupted, it leaves the journal, from which the same run goes on."""
    if output.suffix != ".parquet":
        raise InputError(must("the fleet's output", "a file that ends in .parquet", output))
    began = time.perf_counter()
    with Journal(output, settings.key) as journal:
        rows, left = _sorted_out(paths, done_before(output, settings) | journal.done)
        known = len(rows)
        tick(known)
        size = CHUNK[settings.do]
        chunks = [left[at : at + size] for at in range(0, len(left), size)]
        if chunks:
            with closing(each(chunks, partial(work, settings=settings), pool, lost)) as coming:
                for done in coming:
                    journal.add(done)
                    rows += done
                    tick(len(done))
        write_fleet(rows, settings, output)
        journal.finish()
    return Summary(sorted(rows, key=lambda row: row["log"]), known, time.perf_counter() - began)


def _sorted_out(paths: Sequence[str], done: dict[str, Row]) -> tuple[list[Row], list[str]]:
    """Rows of logs done before, under the name they have now, and the paths of the others."""
    rows: list[Row] = []
    left: list[str] = []
    for path in paths:
        row = done.get(_hash(path)) if done else None
        rows += [row | {"log": path}] if row else []
        left += [] if row else [path]
    return rows, left


def _hash(path: str) -> str:
    try:
        return sha256(path)
    except OSError:
        return ""
