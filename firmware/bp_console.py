# bp_console.py: lines that a host sends over the port of the REPL while the board works. Looking for them allocates
# nothing. Bytes are read and not characters: half a character of UTF-8 would be waited for, and one that is none
# would raise. What is not printable ASCII, mpremote's control characters among it, ends a line that is then forgotten;
# Ctrl-C never comes here, it ends the program.
import select
import sys

from micropython import const

_LONGEST = const(40)


class Console:
    def __init__(self):
        self._poll = select.poll()
        self._poll.register(sys.stdin, select.POLLIN)
        self._line = ""
        self._byte = bytearray(1)
        for _ in self._poll.ipoll(0):  # it makes its tuple at the first look
            pass

    def command(self, wait_ms=0):  # a whole line, None while there is none
        ready = False
        for _ in self._poll.ipoll(wait_ms):
            ready = True
        return self._read() if ready else None

    def _read(self):
        if not sys.stdin.buffer.readinto(self._byte):
            return None
        code = self._byte[0]
        if code == 10 or code == 13:
            line, self._line = self._line, ""
            return line.strip() or None
        self._line = self._line + chr(code) if 32 <= code < 127 and len(self._line) < _LONGEST else ""
        return None
