"""A build's folder: there whole or not at all."""

import json
import os
import shutil
from pathlib import Path
from typing import Any

from barberpole.built import LISTING
from barberpole.errors import InputError, must


def require_replaceable(folder: Path) -> None:
    """Raise InputError where a build must not be put: a file, or a folder of something else."""
    if folder.exists() and not folder.is_dir():
        raise InputError(must("the output", "a folder", "a file", folder))
    if folder.is_dir() and any(folder.iterdir()) and not (folder / LISTING).exists():
        raise InputError(must("the output", "a new or empty folder, or a former build", "a folder with files", folder))


def write_folder(folder: Path, content: dict[str, bytes]) -> None:
    """The whole folder beside its place, then moved there; a former build is moved away first and put back on error."""
    beside = folder.with_name(f"{folder.name}.tmp-{os.getpid()}")
    old = folder.with_name(f"{folder.name}.old-{os.getpid()}")
    try:
        for name, data in content.items():
            path = beside / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        if folder.exists():
            folder.rename(old)
        beside.rename(folder)
    except OSError as error:
        if old.exists() and not folder.exists():
            old.rename(folder)
        raise InputError(must("the output folder", "one that can be written", error.strerror, folder)) from None
    finally:
        shutil.rmtree(beside, ignore_errors=True)
        shutil.rmtree(old, ignore_errors=True)


def as_json(value: Any) -> bytes:
    """JSON as the files of a build hold it."""
    return (json.dumps(value, indent=1, sort_keys=True) + "\n").encode()
