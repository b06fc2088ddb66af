# bp_console.py: lines that a host sends over the port of the REPL while the board works. Looking for them allocates
# nothing. Control characters, by which mpremote asks for its prompt, end a line that is then forgotten; Ctrl-C never
# comes here, it ends the program.
import select
import sys

from micropython import const

_LONGEST = const(40)


class Console:
    def __init__(self):
        self._poll = select.poll()
        self._poll.register(sys.stdin, select.POLLIN)
        self._line = ""
        for _ in self._poll.ipoll(0):  # it makes its tuple at the first look
            pass

    def command(self, wait_ms=0):  # a whole line, None while there is none
        ready = False
        for _ in self._poll.ipoll(wait_ms):
            ready = True
        return self._read() if ready else None

    def _read(self):
        char = sys.stdin.read(1)
        if char in ("\n", "\r"):
            line, self._line = self._line, ""
            return line.strip() or None
        self._line = "" if not char or char < " " or len(self._line) >= _LONGEST else self._line + char
        return None
