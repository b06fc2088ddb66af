"""What `barberpole build` left in a folder: read and checked once, here, for whoever puts it on a board."""

import contextlib
import glob
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from barberpole.errors import InputError, must
from barberpole.files import read_bytes, read_text
from barberpole.mpy import ARCHITECTURES, compile_module

LISTING = "build.json"
OLD = ".old-"
"""A former build that is moved aside is called by its name and this."""
MAIN = "main.py"
NATIVE_FOR = (7, 8)
"""Architectures (bits 10 to 13 of sys.implementation._mpy) that run a build's native code: armv7emsp and armv7emdp."""


@dataclass(frozen=True)
class Built:
    """A build: `files` by path on the board, relative to its working folder, the main program last."""

    folder: Path
    build: str
    """12 hex digits of the sources; the module bp_build holds them."""
    board: str
    calibration: str
    files: dict[str, bytes]
    texts: dict[str, str]
    """Source text of those files that are native code, by path on the board."""
    romfs: bytes
    firmware: dict[str, Any]
    """board_dir, variant and install of the board definition; empty where there is none."""

    @property
    def sha256(self) -> dict[str, str]:
        """Hash of each file by its path on the board."""
        return {target: sha256(data) for target, data in self.files.items()}


def recover(folder: Path) -> None:
    """Put the former build back to its place, where a build was killed after it had moved it aside."""
    folder = folder.resolve()
    if folder.exists():
        return
    former = [(path.stat().st_mtime, path) for path in folder.parent.glob(f"{glob.escape(folder.name)}{OLD}*")]
    for _, path in sorted(former, reverse=True):
        with contextlib.suppress(OSError):  # somebody else was quicker
            path.rename(folder)
            return


def read_built(folder: Path) -> Built:
    """Read a build folder. Raises InputError where it is none or a file is not what was built."""
    recover(folder)
    listing = folder / LISTING
    if not listing.exists():
        raise InputError(must("the build", "a folder made by `barberpole build`", f"no {LISTING}", folder))
    try:
        described = json.loads(read_text(listing, "the build's listing"))
        entries = sorted(described["files"], key=lambda entry: entry["target"] == MAIN)
        files = {entry["target"]: _content(folder, entry) for entry in entries}
        texts = {entry["target"]: read_text(folder / entry["text"], "a source") for entry in entries if "text" in entry}
        romfs = _content(folder, described["romfs"])
        head = (described["build"], described["board"], described["calibration"])
        return Built(folder, *head, files, texts, romfs, described["firmware"])
    except (ValueError, KeyError, TypeError):
        raise InputError(must(LISTING, "as this `barberpole build` writes it", "another form", listing)) from None


def for_processor(built: Built, number: int) -> tuple[dict[str, bytes], bytes]:
    """Files and ROMFS image for a board of this architecture (a place in mpy.ARCHITECTURES).

    A build's native code is for the Cortex-M4. The emulated board's interpreter is a PC's, so those modules are
    compiled anew for it. Raises InputError where they hold what only the Cortex-M4 has.
    """
    if number in NATIVE_FOR or not built.texts:
        return built.files, built.romfs
    if not 0 < number < len(ARCHITECTURES):
        raise InputError(must("the board", "one that runs native code, as this build holds it", "another", built.board))
    made = {
        target: compile_module(f"{Path(target).stem}.py", text, ARCHITECTURES[number])
        for target, text in built.texts.items()
    }
    files = built.files | made
    return files, romfs_image({Path(target).name: data for target, data in files.items() if target != MAIN})


def romfs_image(modules: Mapping[str, bytes]) -> bytes:
    """A ROMFS image with the modules in /lib, in the order of their names."""
    from mpremote.romfs import VfsRomWriter

    writer = VfsRomWriter()
    writer.opendir("lib")
    for name in sorted(modules):
        writer.mkfile(name, modules[name])
    writer.closedir()
    return bytes(writer.finalise())


def sha256(data: bytes) -> str:
    """In hex."""
    return hashlib.sha256(data).hexdigest()


def _content(folder: Path, entry: dict[str, Any]) -> bytes:
    path = folder / entry["source"]
    data = read_bytes(path, "a file of the build")
    if sha256(data) != entry["sha256"]:
        raise InputError(must(path.name, f"as built ({LISTING})", "another content: build again", folder))
    return data
