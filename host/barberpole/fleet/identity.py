"""Which board a log is of, from which lot, and when: the board's own word, else the file's name and folder."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from barberpole.errors import InputError, must

DATE = re.compile(r"[ ._-]?(?P<date>\d{4}-?\d{2}-?\d{2}(?:[T ._-]?\d{2}[:-]?\d{2}(?:[:-]?\d{2})?)?)(?!\d)")
BY_FOLDER = r"(?P<board>[^/\\]+)[/\\][^/\\]+$"
BY_TWO = r"(?P<board>[^/\\]+[/\\][^/\\]+)[/\\][^/\\]+$"
GROUPS = ("board", "date", "lot")


@dataclass(frozen=True)
class Identity:
    """Board, lot and date (as text that sorts; None if nothing says it)."""

    board: str
    lot: str
    date: str | None


def identity(path: Path, told: dict[str, Any], pattern: str | None = None) -> Identity:
    """A log's metadata (`uid` or `board_id`, `lot`, `date`) come first, then `pattern`, then name and folder.

    pattern     a regular expression searched in the path, with groups named board, date and lot
    """
    named, folder = _by_pattern(path, pattern), path.absolute().parent
    board = told.get("uid") or told.get("board_id") or named.get("board") or DATE.sub("", path.stem)
    if (
        not board or Path(named.get("board") or ".").name == folder.name
    ):  # the folder is the board's, above it the lot's
        board, folder = board or folder.name, folder.parent
    lot = told.get("lot") or named.get("lot") or folder.name
    date = told.get("date") or named.get("date")
    return Identity(str(board), str(lot), _compact(str(date)) if date else None)


def in_folders(paths: Sequence[str]) -> str | None:
    """The pattern for logs that all have one name, each in its board's folder (b1/log.csv, b2/log.csv); else None.

    Folders of one name in several others (lot1/b1, lot2/b1) are several boards, unless those are dates.
    """
    names, folders = {Path(path).name for path in paths}, {Path(path).parent for path in paths}
    if len(names) != 1 or len(folders) < 2:
        return None
    twice = len({folder.name for folder in folders}) < len(folders)
    return BY_TWO if twice and not all(DATE.search(folder.parent.name) for folder in folders) else BY_FOLDER


def check_pattern(pattern: str) -> str:
    """The pattern, if it is one. Raises InputError otherwise."""
    wanted = (
        "a regular expression with a group (?P<board>...), and (?P<date>...) or (?P<lot>...) if the names hold them"
    )
    try:
        groups = re.compile(pattern).groupindex
    except re.error as error:
        raise InputError(must("--name", wanted, f"{pattern!r}: {error}")) from None
    if not set(groups) & set(GROUPS):
        raise InputError(must("--name", wanted, repr(pattern)))
    return pattern


def _by_pattern(path: Path, pattern: str | None) -> dict[str, str | None]:
    found = re.search(pattern, str(path)) if pattern else DATE.search(path.stem)
    return found.groupdict() if found else {}


def _compact(date: str) -> str:
    """Digits only, so that dates written in several ways sort as one: 2026-05-01T10:30 and 20260501_1030."""
    digits = re.sub(r"\D", "", date)
    return f"{digits[:4]}-{digits[4:6]}-{digits[6:8]}" + (f"T{digits[8:14]}" if digits[8:] else "")
