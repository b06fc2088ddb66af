"""What is to be done with every log of a fleet, with a hash by which what is done already is known."""

import hashlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from barberpole import __version__
from barberpole.board import load_sensor
from barberpole.errors import InputError, must
from barberpole.files import read_bytes
from barberpole.modelfile import ModelFile, short_hash

TASKS = ("fit", "verify", "diagnose")


@dataclass(frozen=True)
class Settings:
    """do: one of TASKS. calibration: a file, a path with {board} in it, or the Parquet file of a fleet fit (verify).

    name    regular expression that finds board, date and lot in a path
    key     short hash of all that the answer depends on beside the log
    """

    do: str
    model: ModelFile | None
    calibration: str | None = None
    sensor: str | None = None
    name: str | None = None
    key: str = ""


def settings_of(
    do: str,
    model: ModelFile | None,
    calibration: str | None = None,
    sensor: str | None = None,
    name: str | None = None,
) -> Settings:
    """Settings with their key. Raises InputError for files that cannot be read."""
    if do not in TASKS:
        raise InputError(must("--do", " or ".join(TASKS), repr(do)))
    plugins = [_sha256(path) for path in model.plugins] if model else []
    known = asdict(load_sensor(sensor)) if sensor else None
    held = _calibrations(calibration) if calibration else []
    # the name decides which calibration a log is held against, and nothing of a fit
    named = name if calibration else None
    parts = [__version__, do, model.hash if model else None, plugins, repr(known), held, named]
    return Settings(do, model, calibration, sensor, name, short_hash(parts))


def _calibrations(source: str) -> Sequence[tuple[str, str]]:
    """Name and hash of every file that the calibrations may come from."""
    if "{board}" not in source:
        return [(Path(source).name, _sha256(source))]
    pattern = Path(source.replace("{board}", "*"))
    files = sorted(Path(pattern.anchor).glob(str(pattern.relative_to(pattern.anchor))))
    if not files:
        raise InputError(must("--calibration", "a path that fits at least one file", source))
    return [(str(path), _sha256(path)) for path in files]


def _sha256(path: str | Path) -> str:
    return hashlib.sha256(read_bytes(path, "the file")).hexdigest()
