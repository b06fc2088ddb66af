"""Which way a board takes a build, and what on the board stands before it or lies about unused."""

from dataclasses import dataclass
from pathlib import PurePosixPath

from barberpole.built import Built
from barberpole.errors import InputError, must
from barberpole.link.asking import FROZEN_MARK, ROM, BoardState

MPY, ROMFS, FROZEN, AUTO = "mpy", "romfs", "frozen", "auto"
WAYS = (AUTO, MPY, ROMFS, FROZEN)


@dataclass(frozen=True)
class Strays:
    """Paths on the board of modules that are not the build's. `shadows` are imported instead of it, `idle` are not."""

    shadows: tuple[str, ...]
    idle: tuple[str, ...]

    @property
    def removable(self) -> tuple[str, ...]:
        """Those in the file system; what is in ROMFS or in the firmware can only be replaced there."""
        return tuple(path for path in (*self.shadows, *self.idle) if not path.startswith(ROM))


def choose(way: str, state: BoardState, image_bytes: int) -> str:
    """The way to take: the one asked for, else the first that the board's firmware is made for.

    Frozen modules come before everything else that a board has, so a board that has some can only be served so.
    Raises InputError where the board does not have the way that was asked for.
    """
    if way not in WAYS:
        raise InputError(must("--way", "one of " + ", ".join(WAYS), way))
    if way == ROMFS and state.romfs_bytes < image_bytes:
        room = f"{state.romfs_bytes} bytes" if state.romfs_bytes else "none (stock firmware has none on this board)"
        raise InputError(must("the board's ROMFS partition", f"at least {image_bytes} bytes", room, state.machine))
    if way != AUTO:
        return way
    if state.frozen_build:
        return FROZEN
    return ROMFS if state.romfs_bytes >= image_bytes else MPY


def strays(state: BoardState, way: str, built: Built) -> Strays:
    """What lies before the build's place in sys.path, beside it in another form, or behind it.

    A folder holds a module as text, compiled or as a package; MicroPython takes a package first and text before
    compiled modules. A file in the working folder comes before all others.
    """
    stems = {PurePosixPath(target).stem for target in built.files}
    shadows: list[str] = []
    idle: list[str] = []
    reached = False
    for folder in _in_order(state, way):
        names = [name for name in _names(state, folder) if PurePosixPath(name).stem in stems]
        if _is_place(folder, way, state):
            reached = True
            shadows += [f"{folder}/{name}" for name in names if not name.endswith(".mpy") and way != FROZEN]
        elif FROZEN_MARK not in folder:
            (idle if reached else shadows).extend(f"{folder.rstrip('/')}/{name}" for name in names)
    return Strays(tuple(shadows), tuple(idle))


def _in_order(state: BoardState, way: str) -> list[str]:
    """Folders of sys.path, each once, the empty name as what it means.

    A partition without an image is not mounted; once it has one it comes after the frozen modules.
    """
    folders = list(dict.fromkeys(folder or state.cwd for folder, _ in state.folders))
    if way == ROMFS and ROM not in folders:
        behind = [at for at, folder in enumerate(folders) if FROZEN_MARK in folder]
        folders.insert(max(behind, default=-1) + 1, ROM)
    return folders


def _names(state: BoardState, wanted: str) -> list[str]:
    found = {name: None for folder, names in state.folders if (folder or state.cwd) == wanted for name in names}
    return list(found)


def _is_place(folder: str, way: str, state: BoardState) -> bool:
    if way == FROZEN:
        return FROZEN_MARK in folder
    return folder == (ROM if way == ROMFS else state.lib)
