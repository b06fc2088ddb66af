"""The emulated board as a process of its own: one loop over the port, the interpreter and the physics.

`Twin` starts it with a control connection on its standard input; it ends when that connection does. Interpreter and
physics take turns, so both are kept on one processor: a turn costs a tenth there of what it costs across two.
"""

import math
import os
import select
import signal
import sys
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection

from barberpole.twin.ads131m08 import NEVER_US
from barberpole.twin.port import Port
from barberpole.twin.running import HARD, POWER_ON, SOFT, Ending, Job, Running, Start
from barberpole.twin.wiring import AnyWorld, Wiring, wired

LOG_BYTES = 8 << 20
LOOK_S = 0.02  # how often it is checked whether somebody opened the port
MAX_CRASHES = 3


@dataclass(frozen=True)
class Power:
    """What one power-up is made of."""

    world: AnyWorld
    seed: int
    faults: frozenset[str]
    cut_s: float = math.inf
    """s. Board time at which the power goes away again."""
    wrap_s: float = 0.0
    """s. Board time at which the ticks begin at 0 again."""


class BoardProcess:
    """The board, its port, and the interpreter that runs on it at the moment."""

    def __init__(self, job: Job, control: Connection):
        self._job, self._control = job, control
        self._port = Port()
        self._poll = select.poll()
        self._watched: set[int] = set()
        self._watch(control.fileno(), True)
        self._power_ups = self._crashes = 0
        self._power: Power | None = None
        self._soldered: Wiring | None = None
        self._running: Running | None = None
        self._now_us = self._start_us = 0
        self._cut = False
        self._said, self._log = 0, bytearray()

    def run(self) -> None:
        """Be a board until the control connection closes."""
        look_at = 0.0
        try:
            while True:
                now_s = time.monotonic()
                if now_s >= look_at:
                    self._look(now_s)
                    look_at = now_s + LOOK_S
                running = self._running
                for fd, _ in self._poll.poll(1000.0 * LOOK_S):
                    self._serve(fd)
                    if self._running is not running:
                        break  # the other events may be of descriptors that mean something else now
        except EOFError:
            self._power_off()
            self._port.close()

    def _serve(self, fd: int) -> None:
        running = self._running
        if running and fd == running.wire_fd:
            if not running.serve_wire(self._allow):
                self._watch(fd, False)  # its terminal will tell how it ended
        elif running and fd == running.terminal_fd:
            if not running.take_output():
                self._restart(self._end())
        elif fd == self._port.fileno:
            self._serve_port()
        elif fd == self._control.fileno():
            self._control.send(self._answer(*self._control.recv()))

    def _look(self, now_s: float) -> None:
        """Things that nobody tells us: whether the port was opened or closed, whether Ctrl-C has waited too long."""
        self._watch(self._port.fileno, self._port.look())
        self._port.flush()
        if self._running:
            self._watch(self._running.terminal_fd, not self._port.is_full)  # a full port makes the board wait
            self._running.look(now_s)

    def _watch(self, fd: int, wanted: bool) -> None:
        if wanted and fd not in self._watched:
            self._watched.add(fd)
            self._poll.register(fd, select.POLLIN)
        elif not wanted and fd in self._watched:
            self._watched.discard(fd)
            self._poll.unregister(fd)

    def _serve_port(self) -> None:
        data = self._port.receive()
        if not data:
            self._watch(self._port.fileno, self._port.look())
            self._port.flush()
        elif self._running and self._running.receive(data):
            self._port.drop()

    def _say(self, data: bytes) -> None:
        self._said += len(data)
        self._log += data
        del self._log[:-LOG_BYTES]
        self._port.send(data)
        self._port.flush()

    def _power_on(self, power: Power) -> None:
        """Fresh chips, unknown magnetisation, the same flash."""
        self._power_off()
        self._power = power
        self._power_ups += 1
        self._crashes = 0
        self._cut = False
        self._port.power_on()
        self._soldered = wired(self._job.board, power.world, power.seed, self._power_ups, power.faults)
        self._start(POWER_ON)

    def _power_off(self) -> None:
        """The interpreter stops where it is."""
        if self._running:
            self._running.kill()
            self._end()

    def _start(self, cause: int, now_us: int = 0, raw: bool = False) -> None:
        if self._power is None or self._soldered is None:
            return
        cut_us = NEVER_US if math.isinf(self._power.cut_s) else math.ceil(1e6 * self._power.cut_s)
        self._start_us = now_us
        self._soldered.release_pins(now_us)
        start = Start(cause, raw, now_us, cut_us, round(1e6 * self._power.wrap_s), self._power.faults)
        self._running = Running(self._job, self._soldered, start, self._say)
        self._watch(self._running.wire_fd, True)

    def _end(self) -> Ending:
        running, self._running = self._running, None
        if running is None:
            raise EOFError
        self._watch(running.wire_fd, False)
        self._watch(running.terminal_fd, False)
        ending = running.end()
        self._now_us = ending.now_us
        return ending

    def _restart(self, ending: Ending) -> None:
        """After an exit that nobody outside asked for: power cut, machine.reset(), soft reset or crash."""
        if self._cut:
            return
        if ending.cause is not None:
            self._start(ending.cause, ending.now_us)
        elif not os.WIFSIGNALED(ending.status):
            self._say(b"MPY: sync filesystems\r\nMPY: soft reboot\r\n")
            self._start(SOFT, ending.now_us, ending.raw)
        elif self._crashes < MAX_CRASHES:
            self._crashes += 1
            self._say(b"the interpreter crashed (signal %d)\r\n" % os.WTERMSIG(ending.status))
            self._start(HARD, ending.now_us)

    def _allow(self, now_us: int) -> bool:
        """Whether there is power at this board time; where it ends, the interpreter does."""
        if self._power is None or now_us * 1e-6 < self._power.cut_s:
            return True
        self._cut = True
        if self._running:
            self._running.kill()
        return False

    def _time_us(self) -> int:
        return self._running.now_us if self._running else self._now_us

    def _answer(self, command: str, argument):
        match command:
            case "port":
                return self._port.name
            case "power_on":
                return self._power_on(argument)
            case "power_off":
                return self._power_off()
            case "time":
                return 1e-6 * self._time_us()
            case "start":
                return 1e-6 * self._start_us
            case "truth":
                return self._soldered.truth(self._time_us()) if self._soldered else {}
            case "said":
                return self._said
            case "log":
                gone = self._said - len(self._log)
                return self._log[max(argument - gone, 0) :].decode("utf-8", "replace")
            case "pid":
                return self._running.pid if self._running else 0
        raise EOFError


def main() -> None:
    """Entry of the process: the job comes first over the control connection."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C in the user's terminal is the parent's to handle
    control = Connection(os.dup(sys.stdin.fileno()))
    job = control.recv()
    if hasattr(os, "sched_setaffinity"):
        processors = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {processors[os.getpid() % len(processors)]})
    BoardProcess(job, control).run()
