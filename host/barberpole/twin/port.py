"""The serial port that a PC opens: the outer pseudo-terminal, with what is kept while nobody reads.

A serial library empties the port as the last step of opening it, and would lose what was already there. The terminal is
in packet mode, which tells the board's end of that, and until then nothing is sent.
"""

import contextlib
import fcntl
import os
import pty
import select
import struct
import termios
import time

from barberpole.twin.interpreter import make_raw

KEPT_BYTES = 1 << 20  # output held for a reader; beyond it the board waits
SETTLE_S = 1.0  # a program that has neither emptied the port nor written to it by then (cat) reads as it is
DATA = 0  # first byte of a read in packet mode; the others are flags


class Port:
    """The board's end (`fileno`) and the name of the PC's end (`name`)."""

    def __init__(self):
        self.fileno, far_end = pty.openpty()
        self.name = os.ttyname(far_end)
        os.close(far_end)  # held open, it would hide whether anybody is there
        fcntl.ioctl(self.fileno, termios.TIOCPKT, struct.pack("i", 1))
        os.set_blocking(self.fileno, False)
        make_raw(self.fileno)
        self._kept = bytearray()
        self._open_since: float | None = None
        self._settled = False

    def look(self) -> bool:
        """Whether something can be received: a program has the port open, or has left something behind."""
        poll = select.poll()
        poll.register(self.fileno, select.POLLIN)
        events = dict(poll.poll(0)).get(self.fileno, 0)
        is_open = not events & select.POLLHUP
        if is_open and self._open_since is None:
            self._open_since = time.monotonic()
        elif not is_open and self._open_since is not None:
            self._open_since, self._settled = None, False
            make_raw(self.fileno)  # whatever the last program made of it
            termios.tcflush(self.fileno, termios.TCOFLUSH)  # what it has not read is not the next one's
        return is_open or bool(events & select.POLLIN)

    @property
    def is_full(self) -> bool:
        """Whether the board has to wait before it says more."""
        return len(self._kept) >= KEPT_BYTES

    @property
    def has_output(self) -> bool:
        """Whether something waits to be read and somebody is there to read it."""
        if not self._kept or self._open_since is None:
            return False
        return self._settled or time.monotonic() - self._open_since >= SETTLE_S

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

    def power_on(self) -> None:
        """What nobody was there to read has gone with the power."""
        if self._open_since is None:
            self.drop()

    def drop(self) -> None:
        """Forget what was not read: Ctrl-C was pressed, and its sender wants the prompt."""
        self._kept.clear()

    def receive(self) -> bytes:
        """What the PC has sent; empty when it has only emptied the port, or closed it."""
        try:
            packet = os.read(self.fileno, 65536)
        except OSError:
            return b""
        if not packet:
            return b""
        if packet[0] == DATA or packet[0] & termios.TIOCPKT_FLUSHREAD:
            self._settled = self._open_since is not None
            if not self._settled:
                make_raw(self.fileno)  # of a program that came and went between two looks
        return packet[1:] if packet[0] == DATA else b""

    def close(self) -> None:
        """Remove the port."""
        os.close(self.fileno)
