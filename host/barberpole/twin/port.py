"""The serial port that a PC opens: the outer pseudo-terminal, with what is kept while nobody reads."""

import contextlib
import os
import pty
import select
import time

from barberpole.twin.interpreter import make_raw

KEPT_BYTES = 1 << 20  # output held for a reader; beyond it the board waits
SETTLE_S = 0.03  # a program that has just opened the port first empties it


class Port:
    """The board's end (`fileno`) and the name of the PC's end (`name`)."""

    def __init__(self):
        self.fileno, far_end = pty.openpty()
        make_raw(far_end)
        self.name = os.ttyname(far_end)
        os.close(far_end)  # held open, it would hide whether anybody is there
        os.set_blocking(self.fileno, False)
        self._kept = bytearray()
        self._open_since: float | None = None

    def check_open(self) -> bool:
        """Whether a program has the port open."""
        poll = select.poll()
        poll.register(self.fileno, 0)
        is_open = not poll.poll(0)
        if not is_open:
            self._open_since = None
        elif self._open_since is None:
            self._open_since = time.monotonic()
        return is_open

    @property
    def is_full(self) -> bool:
        """Whether the board has to wait before it says more."""
        return len(self._kept) >= KEPT_BYTES

    @property
    def has_output(self) -> bool:
        """Whether something waits to be read and somebody is there to read it."""
        return bool(self._kept) and self._open_since is not None and time.monotonic() - self._open_since >= SETTLE_S

    def send(self, data: bytes) -> None:
        """Keep bytes for the reader."""
        self._kept += data

    def flush(self) -> None:
        """Write what the terminal takes."""
        if not self.has_output:
            return
        with contextlib.suppress(BlockingIOError):
            while self._kept:
                written = os.write(self.fileno, self._kept[:65536])
                del self._kept[:written]

    def drop(self) -> None:
        """Forget what was not read: Ctrl-C was pressed, and its sender wants the prompt."""
        self._kept.clear()

    def receive(self) -> bytes:
        """What the PC has sent; empty when it has closed the port."""
        try:
            return os.read(self.fileno, 65536)
        except OSError:
            return b""

    def close(self) -> None:
        """Remove the port."""
        os.close(self.fileno)
