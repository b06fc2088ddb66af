"""What is on the bench: a log, a model, and the rows left out. A plain value, so that every attempt can be kept."""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from barberpole.modelfile import ModelFile, short_hash

START = ("bias", "scale", "misalignment")  # what every sensor has


@dataclass(frozen=True)
class Bench:
    """log: the file. excluded: half-open ranges of its rows, in order and apart from each other. rest: a log of the
    sensor at rest, which says what is noise."""

    log: Path
    file: ModelFile = field(default_factory=lambda: ModelFile(START))
    excluded: tuple[tuple[int, int], ...] = ()
    rest: Path | None = None

    @property
    def key(self) -> str:
        """Tells two benches apart, also where a plugin was edited in between."""
        return short_hash([str(self.log), self.file.hash, self.plugins_key, self.excluded])

    @property
    def plugins_key(self) -> str:
        """Tells apart which own effects there are, by what their files say."""
        there = [Path(plugin) for plugin in self.file.plugins if Path(plugin).exists()]
        return short_hash([(str(path), hashlib.sha256(path.read_bytes()).hexdigest()) for path in there])

    @property
    def rows_key(self) -> str:
        """Tells apart which rows of which log are looked at."""
        return short_hash([str(self.log), self.file.sensor, self.excluded])

    def kept(self, n: int) -> np.ndarray | slice:
        """Rows of an n-row log that are not left out."""
        if not self.excluded:
            return slice(None)
        keep = np.ones(n, bool)
        for first, last in self.excluded:
            keep[first:last] = False
        return keep

    def without(self, rows: np.ndarray) -> "Bench":
        """The same with more rows (indices into the log) left out."""
        ranges = merged([*self.excluded, *ranges_of(rows)])
        return replace(self, excluded=ranges)

    def with_file(self, file: ModelFile) -> "Bench":
        return replace(self, file=file)


def ranges_of(rows: np.ndarray) -> list[tuple[int, int]]:
    """Row numbers as half-open ranges of neighbours."""
    rows = np.unique(np.asarray(rows, int))
    if not rows.size:
        return []
    breaks = np.flatnonzero(np.diff(rows) > 1)
    first, last = rows[np.append(0, breaks + 1)], rows[np.append(breaks, rows.size - 1)] + 1
    return [(int(a), int(b)) for a, b in zip(first, last, strict=True)]


def merged(ranges: Iterable[tuple[int, int]]) -> tuple[tuple[int, int], ...]:
    """Ranges in order, those that touch joined."""
    out: list[tuple[int, int]] = []
    for first, last in sorted(ranges):
        if out and first <= out[-1][1]:
            out[-1] = (out[-1][0], max(last, out[-1][1]))
        else:
            out.append((first, last))
    return tuple(out)
