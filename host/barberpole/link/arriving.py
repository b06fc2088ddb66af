"""A file that comes over a cable: there when it is whole, not there before."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from barberpole.errors import InputError, must


@contextmanager
def arriving(target: Path) -> Iterator[Path]:
    """A path beside `target` to write to. It becomes `target` when the block ends well; otherwise nothing is left.

    Raises InputError where `target` cannot be written, before anything is asked of the board if that can be known.
    """
    beside = target.with_name(f"{target.name}.part")
    try:
        beside.touch()
        if target.is_dir():
            raise IsADirectoryError(0, "a folder")
        yield beside
        beside.replace(target)
    except OSError as error:
        raise InputError(must("the output file", "in a folder that can be written", error.strerror, target)) from None
    finally:
        if beside.parent.is_dir():
            beside.unlink(missing_ok=True)
