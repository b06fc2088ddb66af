"""The difference between the unix interpreter's terminal and a board's: line ends, banners, and the raw prompt.

A board sends "\\r\\n", stays in its raw prompt over a soft reset without showing the friendly one, and passes binary
data untouched while a program has switched Ctrl-C off (as `mpremote mount` does).
"""

import re
from collections.abc import Callable

RAW_BANNER = b"raw REPL; CTRL-B to exit\r\n"
PROMPT = b">>> "
FRIENDLY_END = b"for more information.\r\n"
MOUNT_MARK = b"\x18"  # first byte of a request of `mpremote mount`
TAIL = 200
_BARE_NEWLINE = re.compile(rb"(?<!\r)\n")


class Console:
    """Output of one start of the interpreter on its way to the PC."""

    def __init__(self, raw: bool):
        self.raw = raw
        self.at_prompt = False
        self._swallow = raw
        self._held = b""
        self._tail = b""
        self._binary = False
        self._last = b""

    def output(self, data: bytes, executes: Callable[[], bool]) -> bytes:
        """What the PC gets to see of `data`; `executes()` tells whether a program runs that Ctrl-C would stop."""
        if self._swallow:
            self._held += data
            at = self._held.find(RAW_BANNER)
            if at < 0:
                return b""
            data, self._held, self._swallow = self._held[at:], b"", False
        self._follow(data)
        return self._cook(data, executes)

    def plain(self, data: bytes, executes: Callable[[], bool]) -> bytes:
        """The same for what boot files and main.py say, where no banner means anything."""
        return self._cook(data, executes)

    def _follow(self, data: bytes) -> None:
        """Learn from the banners which prompt the interpreter is in."""
        text = self._tail + data
        raw_at, friendly_at = text.rfind(RAW_BANNER), max(text.rfind(PROMPT), text.rfind(FRIENDLY_END))
        if raw_at >= 0 or friendly_at >= 0:
            self.raw = raw_at > friendly_at
            self.at_prompt = True
        self._tail = text[-TAIL:]

    def _cook(self, data: bytes, executes: Callable[[], bool]) -> bytes:
        if self._binary or MOUNT_MARK in data:
            self._binary = not executes()
        if self._binary:
            return data
        after_return = self._last == b"\r"
        self._last = data[-1:]
        if after_return and data.startswith(b"\n"):
            return b"\n" + _BARE_NEWLINE.sub(b"\r\n", data[1:])
        return _BARE_NEWLINE.sub(b"\r\n", data)
