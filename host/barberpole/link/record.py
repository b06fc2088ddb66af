"""Listen to a board's frames and keep them as they came."""

import time
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

import serial

from barberpole.errors import PortError, must
from barberpole.link.mpremote import require_port

SILENCE_S = 8.0  # a running board sends a frame every few milliseconds, after at most two seconds of self-calibration
RESTART = b"\r\x03\x03\x02\x04"  # interrupt, leave the raw prompt, soft reset: main.py runs again

Line = serial.Serial


def soft_reset(line: Line) -> None:
    """Make the board start again, so that header and self-calibration of the power-up are heard."""
    line.write(RESTART)


def record(
    port: str,
    target: Path,
    frames: int | None = None,
    seconds: float | None = None,
    start: Callable[[Line], None] = lambda _: None,
    tick: Callable[[int], None] | None = None,
) -> int:
    """Write what the board sends to `target` (.bpr) until so many frames, so many seconds, or Ctrl-C; frames kept.

    `start` is called once the port is open and listening. The file appears when the recording ends.
    Raises PortError if the port is not there or the board stays silent; nothing is left then.
    """
    require_port(port)
    beside = target.with_name(target.name + ".part")
    try:
        with serial.Serial(port, 115200, timeout=0.2) as line, beside.open("wb") as file:
            start(line)
            kept = 0
            for text in islice(_frames(line, seconds), frames):
                file.write(text)
                kept += 1
                if tick:
                    tick(1)
    except serial.SerialException as error:
        beside.unlink(missing_ok=True)
        raise PortError(must("the port", "one that can be opened", error, port)) from None
    if not kept:
        beside.unlink()
        silence = f"silence for {SILENCE_S:.0f} s"
        raise PortError(must(f"the board on {port}", "sending records (main.py running)", silence))
    beside.replace(target)
    return kept


def _frames(line: Line, seconds: float | None) -> Iterator[bytes]:
    """Lines that are frames, until the time is over, the board falls silent, or Ctrl-C."""
    pending = b""
    began = heard = time.monotonic()
    try:
        while seconds is None or time.monotonic() - began < seconds:
            block = line.read(max(1, line.in_waiting))
            if block:
                heard = time.monotonic()
            elif time.monotonic() - heard > SILENCE_S:
                return
            *whole, pending = (pending + block).split(b"\n")
            yield from (text.rstrip(b"\r") + b"\n" for text in whole if text.startswith(b"$"))
    except KeyboardInterrupt:
        return
