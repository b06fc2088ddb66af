"""Listen to a board's frames and keep them as they came."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

import serial

from barberpole.errors import InputError, PortError, must
from barberpole.files import cannot_write
from barberpole.link.arriving import arriving
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
    stoppable: bool = False,
) -> int:
    """Write what the board sends to `target` (.bpr) until so many frames, so many seconds, or Ctrl-C; frames kept.

    `start` is called once the port is open and listening. The file appears when the recording ends, by an unplugged
    cable too, and by Ctrl-C if it is `stoppable`: otherwise Ctrl-C goes on to the caller, and nothing is kept. Raises
    PortError if the port is not there or nothing was heard; no file is left then. Raises InputError where the disk is
    full: `target` is as before then, and what came until then is in a file beside it.
    """
    require_port(port)
    with arriving(target) as beside:
        try:
            kept = _record(port, beside, frames, _Clock(seconds), start, tick or (lambda _: None), stoppable)
        except OSError as error:
            raise _cut(beside, target, error) from None
        if not kept:
            silence = f"silence for {SILENCE_S if seconds is None else min(seconds, SILENCE_S):g} s"
            raise PortError(must(f"the board on {port}", "sending records (main.py running)", silence))
    return kept


def _cut(beside: Path, target: Path, error: OSError) -> InputError:
    """What to say of a recording that the disk had no room for; its whole frames stay."""
    count = beside.read_bytes().count(b"\n")
    if not count:
        return cannot_write("the output file", error, target)
    part = target.with_name(f"{target.stem}-part{target.suffix}")
    beside.replace(part)
    said = f"{error.strerror or error} after {count} records, which are in {part.name}"
    return cannot_write("the output file", OSError(error.errno, said), target)


@dataclass(frozen=True)
class _Clock:
    """When to stop listening."""

    seconds: float | None
    began: float = field(default_factory=time.monotonic)

    @property
    def running(self) -> bool:
        return self.seconds is None or time.monotonic() - self.began < self.seconds


def _record(port: str, beside: Path, frames: int | None, clock: _Clock, start, tick, stoppable: bool) -> int:
    """Frames written. Ctrl-C may end it where something was kept; where nothing was, it goes on to the caller."""
    kept = 0
    try:
        with serial.Serial(port, 115200, timeout=0.2) as line, beside.open("wb") as file:
            start(line)
            for text in islice(_frames(line, clock), frames):
                file.write(text)
                kept += 1
                tick(1)
    except KeyboardInterrupt:
        if not (kept and stoppable):
            raise
    except serial.SerialException as error:
        raise PortError(must("the port", "one that can be opened", error, port)) from None
    return kept


def _frames(line: Line, clock: _Clock) -> Iterator[bytes]:
    """Lines that hold frames, until the time is over, the board falls silent, or the cable is unplugged.

    The first may stand behind a prompt that was left there.
    """
    pending = b""
    heard = time.monotonic()
    while clock.running:
        try:
            block = line.read(max(1, line.in_waiting))
        except OSError:  # SerialException among them: the board is gone, what it sent is kept
            return
        if block:
            heard = time.monotonic()
        elif time.monotonic() - heard > SILENCE_S:
            return
        *whole, pending = (pending + block).split(b"\n")
        yield from (text.rstrip(b"\r") + b"\n" for text in whole if b"$" in text)
