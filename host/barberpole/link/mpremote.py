"""mpremote as a child process: what a user would type, with its failures turned into one sentence."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

from barberpole.errors import PortError, must

TIMEOUT_S = 120


def run(port: str, *words: str, timeout_s: float = TIMEOUT_S) -> str:
    """Output of `mpremote connect PORT words...`. Raises PortError if the port or the command fails."""
    require_port(port)
    command = [sys.executable, "-m", "mpremote", "connect", port, *words]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=timeout_s, check=False)
    except subprocess.TimeoutExpired:
        raise PortError(must(f"the board on {port}", f"answering within {timeout_s:.0f} s", "silence")) from None
    if done.returncode:
        last = (done.stderr or done.stdout).strip().splitlines() or ["no message"]
        raise PortError(must(f"mpremote {words[0]}", f"successful on {port}", last[-1]))
    return done.stdout


def require_port(port: str) -> None:
    """Raise PortError if the port does not exist (names such as /dev/ttyACM0; `auto` is left to mpremote)."""
    if port.startswith("/") and not Path(port).exists():
        got = f"{port}, which does not exist (`barberpole doctor` lists boards, `barberpole twin` emulates one)"
        raise PortError(must("the port", "an attached board", got))


def copy(port: str, files: Sequence[tuple[Path, str]], first: str = "") -> None:
    """Copy files to paths on the board in one session; files already the same are skipped.

    Their folders are made, and then the program `first` is run there.
    """
    parents = {parent.as_posix() for _, target in files for parent in PurePosixPath(target).parents}
    make = "import os\n" + "".join(
        f"try: os.mkdir({f!r})\nexcept OSError: pass\n" for f in sorted(parents - {"/", "."})
    )
    words = ["exec", make + first]
    for source, target in files:
        words += ["+", "fs", "cp", str(source), f":{target}"]
    run(port, *words)


def fetch(port: str, source: str, target: Path) -> None:
    """Copy one file from the board."""
    run(port, "fs", "cp", f":{source}", str(target))


def hashes(port: str, paths: Sequence[str]) -> dict[str, str]:
    """sha256 of files as the board computes it; a missing file has an empty one."""
    program = (
        "import hashlib, binascii\n"
        f"for p in {tuple(paths)!r}:\n"
        " try:\n"
        "  h = hashlib.sha256()\n"
        "  with open(p, 'rb') as f:\n"
        "   while True:\n"
        "    b = f.read(512)\n"
        "    if not b: break\n"
        "    h.update(b)\n"
        "  print(p, binascii.hexlify(h.digest()).decode())\n"
        " except OSError: print(p, '-')\n"
    )
    lines = [line.split() for line in run(port, "exec", program).splitlines() if line.strip()]
    try:
        return {path: "" if digest == "-" else digest for path, digest in lines}
    except ValueError:
        raise PortError(must("the board's answer", "a hash of each file", str(lines[-1]), port)) from None


def remove(port: str, paths: Sequence[str]) -> None:
    """Remove files; those that cannot be (folders, read-only places) stay."""
    each = f"import os\nfor p in {tuple(paths)!r}:\n try: os.remove(p)\n except OSError: pass\n"
    run(port, "exec", each)


def reset(port: str) -> None:
    """Power-up without unplugging: the board starts its main program again."""
    run(port, "reset")
