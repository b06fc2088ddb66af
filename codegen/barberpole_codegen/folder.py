"""A build's folder: there whole or not at all.

A folder cannot be replaced in one step: for a moment the former build is there only under another name. Whoever looks
for a build next puts it back (`barberpole.built.recover`), so a kill at any moment costs the new build at most.
"""

import contextlib
import errno
import glob
import json
import os
import secrets
import shutil
import time
from pathlib import Path
from typing import Any

from barberpole.built import LISTING, OLD, recover
from barberpole.errors import InputError, must
from barberpole.files import cannot_write

NEW = ".tmp-"
STALE_S = 3600.0  # no build takes an hour: what is half written and older was left by one that was killed
TRIES = 20  # where two processes build into one folder at the same moment


def require_replaceable(folder: Path) -> None:
    """Raise InputError where a build must not be put: a file, a folder of something else, where one stands."""
    recover(folder)
    if folder.resolve() in (Path.cwd(), *Path.cwd().parents):
        raise InputError(must("the output", "a folder of its own, for it is replaced", "the current one", folder))
    if folder.exists() and not folder.is_dir():
        raise InputError(must("the output", "a folder", "a file", folder))
    if folder.is_dir() and any(folder.iterdir()) and not (folder / LISTING).exists():
        raise InputError(must("the output", "a new or empty folder, or a former build", "a folder with files", folder))


def write_folder(folder: Path, content: dict[str, bytes]) -> None:
    """The whole folder beside its place, then moved there; the former build goes once the new one stands.

    Raises InputError where it cannot be written; the former build is there as before then.
    """
    token = f"{os.getpid()}-{secrets.token_hex(4)}"
    place = folder.resolve()  # of a link, what it points at
    beside = place.with_name(f"{place.name}{NEW}{token}")
    try:
        for name, data in content.items():
            path = beside / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        _exchange(beside, place, f"{place.name}{OLD}{token}")
    except OSError as error:
        raise cannot_write("the output folder", error, folder) from None
    finally:  # by Ctrl-C too
        recover(place)
        shutil.rmtree(beside, ignore_errors=True)
    _sweep(place)


def _exchange(beside: Path, folder: Path, old: str) -> None:
    """Move the folder away and `beside` to its place; once more where another process put one there meanwhile."""
    for left in reversed(range(TRIES)):
        with contextlib.suppress(FileNotFoundError):
            folder.rename(folder.with_name(f"{old}-{left}"))  # that of the last try may still stand
        try:
            beside.rename(folder)
        except OSError as error:
            recover(folder)
            if not left or error.errno not in (errno.EEXIST, errno.ENOTEMPTY):
                raise
        else:
            return


def _sweep(folder: Path) -> None:
    """Remove former builds, and halves of killed ones. A build is renamed first: half of it is no former build."""
    for old in _beside(folder, OLD):
        gone = old.with_name(f"{folder.name}{NEW}{old.name.removeprefix(folder.name + OLD)}-gone")
        with contextlib.suppress(OSError):  # another process sweeps as well
            old.rename(gone)
            shutil.rmtree(gone, ignore_errors=True)
    for half in _beside(folder, NEW):
        with contextlib.suppress(OSError):
            if time.time() - half.stat().st_mtime > STALE_S:
                shutil.rmtree(half, ignore_errors=True)


def _beside(folder: Path, mark: str) -> list[Path]:
    return list(folder.parent.glob(f"{glob.escape(folder.name)}{mark}*"))


def as_json(value: Any) -> bytes:
    """JSON as the files of a build hold it."""
    return (json.dumps(value, indent=1, sort_keys=True) + "\n").encode()
