"""One start of the interpreter on the board, from its boot script to its exit: its wire, its terminal, its input."""

import os
import select
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from barberpole.twin.ads131m08 import NEVER_US
from barberpole.twin.console import Console
from barberpole.twin.faults import FLASH_FAULTS
from barberpole.twin.interpreter import Interpreter
from barberpole.twin.pins import PINS, SPI_CLOCK_HZ
from barberpole.twin.wire import Op, Wire
from barberpole.twin.wiring import AnyBoard, Wiring

INTERRUPT_S = 0.1  # a program that asks nothing for so long is interrupted by a signal
INSIST_S = 2.0  # and one that asks only what must not be interrupted, after this
PORT_RAM_KIB = 92  # of the STM32F405's RAM, what MicroPython itself takes; the rest is heap
POWER_ON, HARD, WATCHDOG, SOFT = 1, 2, 3, 0  # machine.reset_cause()
CTRL_A, CTRL_C = b"\x01", b"\x03"


@dataclass(frozen=True)
class Job:
    """What makes a board, whatever its power does."""

    board: AnyBoard
    micropython: str
    image: Path
    romfs: Path | None = None
    """Content of the ROMFS partition, where the board's firmware has one."""
    frozen: Path | None = None
    """Image of the modules that stand in for frozen ones."""


@dataclass(frozen=True)
class Start:
    """What one start begins with."""

    cause: int
    """Of machine.reset_cause()."""
    raw: bool = False
    """Whether the prompt before was the raw one."""
    now_us: int = 0
    """µs. Board time."""
    cut_us: int = NEVER_US
    """µs. Board time at which the power goes."""
    wrap_us: int = 0
    """µs. Board time at which the ticks begin at 0 again."""
    faults: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Ending:
    """How a start ended: wait status, prompt it was in, board time, and the cause of the reset where there was one."""

    status: int
    raw: bool
    now_us: int
    cause: int | None


class Running:
    """A running interpreter; `say` gets its output."""

    def __init__(self, job: Job, soldered: Wiring, start: Start, say: Callable[[bytes], None]):
        self._say = say
        self._console = Console(start.raw)
        self._wire = Wire(soldered, self._on_op, start.now_us)
        self._interpreter = Interpreter(job.micropython, _heap_bytes(job), self._setup(job, start))
        self._wire.close_far_ends()
        self._started = self._ready = False
        self._cause: int | None = None
        self._pending = b""  # input that waits for the prompt
        self._interrupt_at: float | None = None

    @property
    def pid(self) -> int:
        """Process id of the interpreter."""
        return self._interpreter.pid

    @property
    def now_us(self) -> int:
        """Board time of the last request, µs."""
        return self._wire.now_us

    @property
    def wire_fd(self) -> int:
        """Readable when the interpreter asks something."""
        return self._wire.fileno

    @property
    def terminal_fd(self) -> int:
        """Readable when the interpreter has said something, or has ended."""
        return self._interpreter.fileno

    def _setup(self, job: Job, start: Start) -> dict:
        board, (to, source) = job.board, self._wire.far_ends
        return {
            "to": to,
            "from": source,
            "now": start.now_us,
            "cut": start.cut_us,
            "wrap": start.wrap_us,
            "raw": start.raw,
            "cause": start.cause,
            "image": str(job.image),
            "romfs": str(job.romfs or ""),
            "frozen": str(job.frozen or ""),
            "flash_faults": sorted(start.faults & FLASH_FAULTS),
            "pins": PINS,
            "drdy": board.adc.drdy_pin,
            "adc_reset": board.adc.reset_pin,
            "adc_cs": PINS.index(board.adc.cs_pin),
            "spi_clock_hz": SPI_CLOCK_HZ,
            "cpu_mhz": round(board.cpu_mhz),
            "uid": "TWIN-" + board.name[:7].upper().ljust(7, "0"),  # twelve bytes, as on the chip
        }

    def serve_wire(self, allow: Callable[[int], bool]) -> bool:
        """Answer a request; False when there will be no more. `allow(t_us)` False: there is no power at that time."""
        alive = self._wire.serve(allow)
        if not self._wire.interrupt:
            self._interrupt_at = None  # an answer has brought it
        return alive

    def _on_op(self, op: Op) -> None:
        if op == Op.STARTED:
            self._started = True
            self._wire.interrupt = CTRL_C in self._pending
            self._pending = self._pending.replace(CTRL_C, b"")
            if not self._wire.interrupt:
                self._type(self._pending)
                self._pending = b""
        elif op == Op.READY:
            self._drain()
            self._ready = True
            if self._console.raw:
                self._type(CTRL_A)  # a board stays in its raw prompt
        elif op in (Op.RESET, Op.BITE):
            self._cause = HARD if op == Op.RESET else WATCHDOG
            self.kill()

    def _drain(self) -> None:
        """Take all that the boot files have said, so that it is told apart from the prompt."""
        output = select.poll()
        output.register(self.terminal_fd, select.POLLIN)
        while output.poll(0) and self.take_output():
            pass

    def take_output(self) -> bool:
        """Pass on what the interpreter says; False when it has ended."""
        try:
            data = os.read(self.terminal_fd, 65536)
        except OSError:
            return False
        executes = self._interpreter.executes
        self._say(self._console.output(data, executes) if self._ready else self._console.plain(data, executes))
        if self._ready and self._console.at_prompt and self._pending:
            self._type(self._pending)
            self._pending = b""
        return bool(data)

    def receive(self, data: bytes) -> bool:
        """Input from the PC; True when it interrupts a program."""
        interrupts = CTRL_C in data and self._started and self._interpreter.executes()
        if interrupts:
            self._wire.interrupt = True
            self._interrupt_at = time.monotonic() + INTERRUPT_S
            data = data.replace(CTRL_C, b"")
        if (self._ready and self._console.at_prompt) or (not interrupts and self._listens()):
            self._type(data)
        else:
            self._pending += data
        return interrupts

    def _listens(self) -> bool:
        """Whether main.py runs, to which a PC may talk, and nobody has asked for the prompt."""
        free = self._started and not self._ready and self._interrupt_at is None and not self._wire.interrupt
        return free and not self._pending and self._interpreter.executes()

    def look(self, now_s: float) -> None:
        """A program that asks nothing cannot be answered with the interrupt: it gets a signal."""
        if self._interrupt_at is None or now_s < self._interrupt_at:
            return
        with self._interpreter.stopped():
            if self._wire.asks() and now_s < self._interrupt_at + INSIST_S:
                return
            self._interrupt_at, self._wire.interrupt = None, False
            if self._interpreter.executes():
                self._interpreter.interrupt()
            elif self._ready:
                self._type(CTRL_C)

    def _type(self, data: bytes) -> None:
        while data:
            data = data[os.write(self.terminal_fd, data) :]

    def kill(self) -> None:
        """Take the power away."""
        self._interpreter.kill()

    def end(self) -> Ending:
        """Wait for the exit and close everything."""
        self._wire.close()
        status = self._interpreter.close()
        return Ending(status, self._console.raw, self._wire.now_us, self._cause)


def heap_bytes(board: AnyBoard) -> int:
    """The board's heap, doubled: objects of the 64-bit interpreter are twice the size."""
    return 2 * 1024 * max(board.ram_kib - PORT_RAM_KIB, 32)


def _heap_bytes(job: Job) -> int:
    """With room for what lies in flash on a board."""
    in_flash = (path.stat().st_size for path in (job.romfs, job.frozen) if path)
    return heap_bytes(job.board) + sum(in_flash)
