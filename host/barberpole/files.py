"""Files are replaced whole: a reader sees the old one or the new one, never half of one."""

import contextlib
import errno
import os
import secrets
import stat
from pathlib import Path

from barberpole.errors import InputError, must

LARGEST_TEXT = 4 << 20  # bytes
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def write_atomic(path: str | Path, content: bytes | str) -> None:
    """Write `content` (text as UTF-8) beside `path` and move it into place.

    Raises InputError when the folder is absent or cannot be written; nothing is left behind then.
    """
    path = Path(path)
    require_file(path)
    data = content.encode() if isinstance(content, str) else content
    beside = path.with_name(f"{path.name}.tmp-{os.getpid()}-{secrets.token_hex(4)}")  # threads write too
    try:
        beside.write_bytes(data)
        beside.replace(path)
    except OSError as error:
        _remove(beside)
        raise cannot_write("the output file", error, path) from None
    except BaseException:  # Ctrl-C among them
        _remove(beside)
        raise


def require_file(path: Path) -> None:
    """Raise InputError where an output file is named like a folder that is there."""
    if not path.name or path.is_dir():
        raise InputError(must("the output file", "a file", "a folder", path))


def cannot_write(what: str, error: OSError, where: object) -> InputError:
    """The one sentence about an output that the system refused: a full disk is said to be one."""
    wanted = "on a disk with room" if error.errno in FULL else "in a folder that can be written"
    return InputError(must(what, wanted, error.strerror or error, where))


def _remove(beside: Path) -> None:
    with contextlib.suppress(OSError):  # a parent that is a file, a disk that went away: there is nothing to remove
        beside.unlink(missing_ok=True)


def read_bytes(path: str | Path, what: str, largest: int | None = None) -> bytes:
    """Content of a file of at most `largest` bytes.

    Raises InputError naming `what` it should have been ("the log", "the board file").
    """
    path = Path(path)
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):  # a pipe would be waited for, and a device may never end
            got = "a folder" if stat.S_ISDIR(found.st_mode) else "a pipe or a device"
            raise InputError(must(what, "a file that can be read", got, path))
        if largest is not None and found.st_size > largest:
            raise InputError(must(what, f"a file of at most {largest} bytes", found.st_size, path))
        return path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a name that no file can have
        got = getattr(error, "strerror", None) or error
        raise InputError(must(what, "a file that can be read", got, path)) from None


def read_text(path: str | Path, what: str) -> str:
    """Text of a UTF-8 file that a person may have written. Raises InputError as `read_bytes`, and where the text is
    not UTF-8, or longer than anybody writes."""
    try:
        return read_bytes(path, what, LARGEST_TEXT).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(must(what, "UTF-8 text", f"byte {error.object[error.start]:#04x}", path)) from None
