"""Files onto a board's file system so that the board is whole at every moment.

New files are copied beside their places, compared there, and then moved; the moves are noted on the board first, and
main.py finishes them where the power went in between. So a cable or a plug pulled at any time leaves the former
build, or the new one; where there is no room for both, none. What has already arrived is not copied again.
"""

import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path, PurePosixPath

from barberpole.built import MAIN, sha256
from barberpole.errors import PortError, must
from barberpole.link import mpremote
from barberpole.link.asking import BoardState

STAGE = "lib/bp.new"  # as in firmware/main.py
READY = "ready"
RUNS = "lib/bp_main.mpy"
SPARE_BYTES = 4096  # of the file system, for its own tables and the board's records

_TIDY = """\
try: names = os.listdir({stage!r})
except OSError: names = []
for name in names:
    if name not in {keep!r}: os.remove({stage!r} + '/' + name)
"""
_DISARM = """\
try: os.remove({path!r})
except OSError: pass
"""
_MOVE = """\
import os
open({stage!r} + '/{ready}', 'w').close()
if hasattr(os, 'sync'): os.sync()
for name in {names!r}: os.rename({stage!r} + '/' + name, name if name == {main!r} else 'lib/' + name)
os.remove({stage!r} + '/{ready}')
os.rmdir({stage!r})
if hasattr(os, 'sync'): os.sync()
"""
_CLEAR = """\
import os
for name in os.listdir('lib'):
    if name.startswith('bp_') and name.endswith('.mpy') and name not in {keep!r}: os.remove('lib/' + name)
"""


def install(port: str, files: Mapping[str, bytes], state: BoardState, say: Callable[[str], None]) -> tuple[str, ...]:
    """Bring the board's files (path -> content) up to date; returns the paths that were copied, in order.

    Raises PortError where the board falls silent or a file did not arrive whole; then repeat.
    """
    there = mpremote.hashes(port, list(files))
    wanted = {target: data for target, data in files.items() if there.get(target) != sha256(data)}
    if wanted:
        staged = {f"{STAGE}/{PurePosixPath(target).name}": data for target, data in wanted.items()}
        half = mpremote.hashes(port, list(staged))
        missing = {path: data for path, data in staged.items() if half.get(path) != sha256(data)}
        if state.free - SPARE_BYTES >= sum(_rounded(len(data), state.block) for data in missing.values()):
            copied = _staged(port, staged, missing, say)
        else:
            copied = _in_place(port, wanted, files, say)
        check(port, files)
    else:
        copied = ()
    say(f"{len(files) - len(wanted)} of {len(files)} files were there already")
    return copied


def check(port: str, files: Mapping[str, bytes]) -> None:
    """Compare hashes on the board. Raises PortError for the first file that is not what it must be."""
    there = mpremote.hashes(port, list(files))
    for target, data in files.items():
        if there.get(target) != sha256(data):
            raise PortError(must(f"{target} on the board", "what was built", "another content: flash again", port))


def clear(port: str, files: Mapping[str, bytes]) -> None:
    """Remove modules of a former build that this one does not have."""
    keep = [PurePosixPath(target).name for target in files]
    mpremote.run(port, "exec", _CLEAR.format(keep=keep))


def _staged(
    port: str, staged: Mapping[str, bytes], missing: Mapping[str, bytes], say: Callable[[str], None]
) -> tuple[str, ...]:
    say(f"copying {len(missing)} files to {port}")
    names = [PurePosixPath(path).name for path in staged]
    if missing:
        _copy(port, missing, _TIDY.format(stage=STAGE, keep=names))
        check(port, staged)
    say("moving them to their places")
    mpremote.run(port, "exec", _MOVE.format(stage=STAGE, ready=READY, names=names, main=MAIN))
    return tuple(_place(PurePosixPath(path).name) for path in missing)


def _in_place(
    port: str, wanted: Mapping[str, bytes], files: Mapping[str, bytes], say: Callable[[str], None]
) -> tuple[str, ...]:
    """Where the file system has no room for both builds. The module that runs all others goes first and comes last:
    interrupted meanwhile, the board says that it is not complete and does nothing."""
    say(f"copying {len(wanted)} files to {port}, one over the other: there is no room for both builds")
    order = [path for path in wanted if path not in (RUNS, MAIN)] + [path for path in (RUNS, MAIN) if path in files]
    parts = {path: files[path] for path in order}
    _copy(port, parts, _TIDY.format(stage=STAGE, keep=[]) + _DISARM.format(path=RUNS))
    return tuple(order)


def _copy(port: str, files: Mapping[str, bytes], first: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        pairs = []
        for number, (target, data) in enumerate(files.items()):
            source = Path(folder, str(number))
            source.write_bytes(data)
            pairs.append((source, target))
        mpremote.copy(port, pairs, first)


def _place(name: str) -> str:
    return name if name == MAIN else f"lib/{name}"


def _rounded(size: int, block: int) -> int:
    return -(-size // block) * block
