"""Listen to a board's frames and keep them as they came."""

import time
from collections.abc import Callable
from pathlib import Path

import serial

from barberpole.errors import PortError, must
from barberpole.files import write_atomic
from barberpole.link.mpremote import require_port

SILENCE_S = 5.0  # a running board sends a frame every fraction of a second
RESTART = b"\r\x03\x03\x02\x04"  # interrupt, leave the raw prompt, soft reset: main.py runs again


def record(
    port: str,
    target: Path,
    frames: int | None = None,
    seconds: float | None = None,
    restart: bool = False,
    tick: Callable[[int], None] | None = None,
) -> int:
    """Write what the board sends to `target` (.bpr) until so many frames came or so many seconds passed; frames kept.

    `restart` begins with a soft reset, so that the record holds the header and the self-calibration of the power-up.
    Raises PortError if the port is not there or the board stays silent; nothing is written then.
    """
    require_port(port)
    with serial.Serial(port, 115200, timeout=0.2) as line:
        if restart:
            line.write(RESTART)
        lines = _collect(line, frames, seconds, tick)
    if not lines:
        raise PortError(
            must(f"the board on {port}", "sending records (main.py running)", f"silence for {SILENCE_S:.0f} s")
        )
    write_atomic(target, b"".join(lines))
    return len(lines)


def _collect(line, frames, seconds, tick) -> list[bytes]:
    kept, pending = [], b""
    began = heard = time.monotonic()
    while (frames is None or len(kept) < frames) and (seconds is None or time.monotonic() - began < seconds):
        block = line.read(max(1, line.in_waiting))
        if not block:
            if time.monotonic() - heard > SILENCE_S:
                break
            continue
        heard = time.monotonic()
        *whole, pending = (pending + block).split(b"\n")
        fresh = [text.rstrip(b"\r") + b"\n" for text in whole if text.startswith(b"$")]
        kept += fresh
        if tick and fresh:
            tick(len(fresh))
    return kept
