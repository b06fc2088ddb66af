"""The three ways to the board: what each holds, how much room it takes and how much there is."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from barberpole.board import Board
from barberpole.driver_board import Driver
from barberpole.errors import LimitError, must

from barberpole_codegen.emit import Constant, module
from barberpole_codegen.flash_map import FROZEN, KIB, Definition

MARK = "bp_build"  # the module that says which build a board runs
FROZEN_PER_MPY = 1.05
FROZEN_SOURCE = "1.05 of the .mpy; 23508 bytes for 22377 and 35664 for 35027 were linked (PYBV11, GCC 12.2)"


def build_hash(sources: Mapping[str, str]) -> str:
    """12 hex digits that change with any source file of a build."""
    return hashlib.sha256(json.dumps(sorted(sources.items())).encode()).hexdigest()[:12]


def mark(sources: Mapping[str, str], calibration: str, version: str) -> str:
    """Text of bp_build.py: what a host asks a board for, where the modules cannot be read back as files."""
    build = build_hash(sources)
    names = tuple(sorted(name.removesuffix(".py") for name in sources))
    constants = [Constant("BUILD", build), Constant("CALIBRATION", calibration), Constant("MODULES", names)]
    return module("bp_build.py: which build this is.", f"sources {build}", version, constants=constants)


def figures(
    board: Board | Driver, files: Mapping[str, int], romfs_bytes: int, found: Definition | None
) -> dict[str, Any]:
    """Bytes that each way takes (`bytes`) and has (`of`), and whether it fits.

    Raises LimitError where the files exceed the board's file system: that way must be open to every board.
    """
    total = sum(files.values())
    if total > board.filesystem_kib * KIB:
        limit = f"at most {board.filesystem_kib} KiB (filesystem_kib)"
        raise LimitError(must("the build", limit, f"{total / KIB:.0f} KiB", board.name))
    ways = {"mpy": _way(total, board.filesystem_kib * KIB, "file system of stock firmware")}
    if found is None:
        return ways
    start, end = found.romfs
    frozen = round(FROZEN_PER_MPY * total)
    room = found.map.text[1] - found.map.text[0] - found.map.firmware_bytes
    ways["romfs"] = _way(romfs_bytes, end - start, f"partition at {start:#010x}")
    ways["frozen"] = _way(frozen, room, f"flash beside the stock firmware; estimated: {FROZEN_SOURCE}")
    return ways


def firmware(found: Definition | None) -> dict[str, str]:
    """For build.json: where the board definition is, and how its firmware gets onto the board."""
    if found is None:
        return {}
    board_dir = f"micropython/{found.folder.name}"
    return {"board_dir": board_dir, "variant": FROZEN, "install": found.map.install}


def definition_files(found: Definition | None) -> dict[str, bytes]:
    """The board definition as files of the build folder, beside the sources that it freezes."""
    if found is None:
        return {}
    paths = sorted(path for path in found.folder.iterdir() if path.is_file())
    return {f"micropython/{found.folder.name}/{path.name}": path.read_bytes() for path in paths}


def _way(taken: int, room: int, where: str) -> dict[str, Any]:
    return {"bytes": taken, "of": room, "fits": taken <= room, "where": where}
