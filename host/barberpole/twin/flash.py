"""The image of the board's file system: littlefs2, made and filled by MicroPython itself."""

import json
import os
import subprocess
from collections.abc import Mapping
from pathlib import Path

from barberpole.built import for_processor, read_built, romfs_image
from barberpole.errors import InputError, must
from barberpole.files import cannot_write, write_atomic
from barberpole.mpy import ARCHITECTURES
from barberpole.twin.interpreter import SHIMS

ERASED = b"\xff"
KIB = 1024
FILL_TIMEOUT_S = 60
INTERPRETER = ARCHITECTURES.index("x64")  # of the unix interpreter


def make_image(path: Path, size_kib: int, files: Mapping[str, str | Path], micropython: str) -> None:
    """An image of size_kib at `path`, kept when it is there, with `files` (path on the board -> file) added.

    Raises InputError when the folder cannot be written or the files do not fit.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write("the flash folder", error, path.parent) from None
    if not path.exists():
        write_atomic(path, ERASED * (size_kib * KIB))
    if files:
        _fill(path, files, micropython)


def make_partition(path: Path, size_kib: int) -> Path:
    """An erased ROMFS partition at `path`, kept when it is there. Raises InputError when it cannot be written."""
    make_image(path, size_kib, {}, "")
    return path


def make_frozen(path: Path, build: Path) -> Path:
    """A build's modules and main program as the image that stands in for frozen ones. Raises InputError."""
    files, _ = for_processor(read_built(build), INTERPRETER)
    write_atomic(path, romfs_image({Path(target).name: data for target, data in files.items()}))
    return path


def _fill(path: Path, files: Mapping[str, str | Path], micropython: str) -> None:
    for source in files.values():
        if not Path(source).is_file():
            raise InputError(must("a file for the board", "there", "none", source))
    job = {"image": str(path), "files": {name: str(Path(source).resolve()) for name, source in files.items()}}
    environment = os.environ | {"BARBERPOLE_FILL": json.dumps(job), "MICROPYPATH": str(SHIMS)}
    command = [micropython, str(SHIMS / "_fill.py")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=FILL_TIMEOUT_S, check=False)
    if done.returncode:
        reason = (done.stdout + done.stderr).strip().splitlines()[-1:]
        raise InputError(must("the files for the board", "small enough for its flash", "".join(reason), path))
