"""Frames from a board as they come, and commands to it, over one open port."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import serial

from barberpole.errors import PortError, must
from barberpole.link.mpremote import require_port
from barberpole.records import ANSWER, Decoder, Frame

BAUD = 115200
WAIT_S = 0.2  # of one read
COMMANDS = ("status", "selfcal now", "stream", "stop", "factory reset", "read cal", "read log")


class Listener:
    """An open port. `decoder` counts what was damaged or lost."""

    def __init__(self, line: serial.Serial, port: str):
        self._line, self._port = line, port
        self.decoder = Decoder()

    def frames(self) -> list[Frame]:
        """What has arrived, after at most WAIT_S. Raises PortError when the cable is unplugged."""
        try:
            return self.decoder.feed(self._line.read(max(1, self._line.in_waiting)))
        except OSError as error:  # SerialException among them
            raise PortError(must(f"the board on {self._port}", "attached", error)) from None

    def send(self, command: str) -> None:
        """A line of text to the running program; the newline before ends what was left of another."""
        try:
            self._line.write(b"\n" + command.encode() + b"\n")
        except OSError as error:
            raise PortError(must(f"the board on {self._port}", "attached", error)) from None


@contextmanager
def listening(port: str) -> Iterator[Listener]:
    """An open port. Raises PortError where there is none."""
    require_port(port)
    try:
        line = serial.Serial(port, BAUD, timeout=WAIT_S)
    except serial.SerialException as error:
        raise PortError(must("the port", "one that can be opened", error, port)) from None
    with line:
        yield Listener(line, port)


def ask(port: str, command: str, timeout_s: float = 15.0) -> list[dict]:
    """The answers of the running program to a command; the last one has `done`.

    Raises PortError where the board does not answer: it waits at its prompt, or runs another program.
    """
    with listening(port) as board:
        board.send(command)
        answers: list[dict] = []
        until = time.monotonic() + timeout_s
        while time.monotonic() < until:
            for frame in board.frames():
                if frame.type != ANSWER or frame.json is None or frame.json.get("command") != command:
                    continue
                answers.append(frame.json)
                if "done" in frame.json:
                    return answers
    be = f"answering `{command}` within {timeout_s:g} s"
    got = "half an answer" if answers else "silence: its program is not running (a power cycle or `record` starts it)"
    raise PortError(must(f"the board on {port}", be, got))
