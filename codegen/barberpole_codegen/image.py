"""What goes to a board: the firmware's sources, and a manifest for freezing them.

In ROMFS and in frozen firmware the tables stay in flash; from plain .mpy files they are loaded.
"""

from pathlib import Path

from barberpole.built import MAIN
from barberpole.errors import InputError, must


def firmware_sources(folder: Path) -> dict[str, str]:
    """Text of the firmware by file name. Raises InputError when the folder does not hold it."""
    texts = {path.name: path.read_text() for path in sorted(folder.glob("*.py"))}
    if MAIN not in texts or "bp_main.py" not in texts:
        raise InputError(must("the firmware folder", "one with main.py and bp_main.py", ", ".join(texts), folder))
    return texts


def manifest(names: list[str]) -> str:
    """manifest.py, to be included in that of a board definition: `include("path/to/manifest.py")`.

    The main program is frozen too: a board runs that one and no file, so it starts whatever its file system holds.
    """
    listed = "".join(f'        "{name}",\n' for name in sorted(names))
    return (
        "# Freezes barberpole into the firmware: FROZEN_MANIFEST of MicroPython's stm32 port, or included there.\n"
        'include("$(PORT_DIR)/boards/manifest.py")\n'
        f'freeze(\n    "src",\n    (\n{listed}    ),\n    opt=3,\n)\n'
    )
