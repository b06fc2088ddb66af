"""A file that comes over a cable: there when it is whole, not there before."""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from barberpole.files import cannot_write, require_file


@contextmanager
def arriving(target: Path) -> Iterator[Path]:
    """A path beside `target` to write to. It becomes `target` when the block ends well; otherwise nothing is left.

    Raises InputError where `target` cannot be written, before anything is asked of the board if that can be known.
    """
    require_file(target)
    beside = target.with_name(f"{target.name}.tmp-{os.getpid()}-{secrets.token_hex(4)}")
    try:
        beside.touch()
        yield beside
        beside.replace(target)
    except OSError as error:
        raise cannot_write("the output file", error, target) from None
    finally:
        if beside.parent.is_dir():
            beside.unlink(missing_ok=True)
