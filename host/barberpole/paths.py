"""Where the board files and the firmware are: in the repository, or inside the installed package."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_REPOSITORY = _PACKAGE.parents[1]


def _folder(name: str) -> Path:
    packaged = _PACKAGE / f"_{name}"
    return packaged if packaged.is_dir() else _REPOSITORY / name


def boards() -> Path:
    """Folder of <board>.toml and sensors/<sensor>.toml."""
    return _folder("boards")


def firmware() -> Path:
    """Folder of the MicroPython files that run on the board."""
    return _folder("firmware")
