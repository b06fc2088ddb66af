"""A copy of the repository whose firmware carries markers; its emulated board has room for them."""

import shutil
from pathlib import Path

from lines.marked import Markers

LEFT_OUT = (".git", ".venv", "build", ".hypothesis", "__pycache__", ".pytest_cache", ".ruff_cache", "*.tmp-*")
SHIMS = Path("host/barberpole/twin/shims")
ON_BOARD = Path("tests/firmware/on_board")
ALONE = Path("build/lines")  # for interpreters without a path of their own
# Markers take flash and heap of the emulated board, which the tests would find missing.
ROOM = (
    ("host/barberpole/twin/interpreter.py", "SHIM_HEAP = 32 * 1024", "SHIM_HEAP = 512 * 1024"),
    ("host/barberpole/twin/api.py", "self._board.filesystem_kib", "4 * self._board.filesystem_kib"),
    (str(SHIMS / "_twin.py"), "import json\n", "import _lines\nimport json\n"),  # before the board's flash is mounted
)


def marked_copy(repository: Path, folder: Path, record: Path) -> Markers:
    """Copy the repository to `folder`; what its interpreters pass is written to `record`."""
    shutil.copytree(repository, folder, symlinks=True, ignore=shutil.ignore_patterns(*LEFT_OUT))
    (folder / ".venv").symlink_to((repository / ".venv").resolve())
    markers = Markers()
    for path in sorted((folder / "firmware").rglob("*.py")):
        path.write_text(markers.marked(str(path.relative_to(folder)), path.read_text()))
    record.write_bytes(b"")
    (folder / ALONE).mkdir(parents=True)
    for place in (SHIMS, ON_BOARD, ALONE):
        (folder / place / "_lines.py").write_text(markers.recorder(str(record)))
    for name, old, new in ROOM:
        text = (folder / name).read_text()
        if text.count(old) != 1:
            raise LookupError(f"{name} no longer has `{old.strip()}` once")
        (folder / name).write_text(text.replace(old, new))
    return markers
