"""The emulated board in a `with` statement.

>>> with Twin(board, "flash", World.of(board), seed=1) as twin:  # doctest: +SKIP
...     print(twin.port)  # a serial port for mpremote
...     twin.wait_until(2.0)  # two seconds of board time after power-up
...     twin.power_cycle(faults=("coil_open_x",))
"""

import math
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Any

import barberpole
from barberpole.errors import InputError, PortError, must
from barberpole.twin.faults import check_faults
from barberpole.twin.flash import make_frozen, make_image, make_partition
from barberpole.twin.interpreter import find_micropython
from barberpole.twin.pins import check_pins
from barberpole.twin.process import Power
from barberpole.twin.running import Job
from barberpole.twin.wiring import AnyBoard, AnyWorld, default_world, sensors_of

ANSWER_S = 30.0
STOP_S = 5.0
POLL_S = 0.01


class Twin:
    """An emulated board with its flash image in `flash_dir`; powered up on entering, off on leaving."""

    def __init__(
        self,
        board: AnyBoard,
        flash_dir: str | Path,
        world: AnyWorld | None = None,
        seed: int = 0,
        faults: Iterable[str] = (),
        files: Mapping[str, str | Path] | None = None,
        romfs_kib: int = 0,
        frozen: str | Path | None = None,
        wrap_s: float = 0.0,
    ):
        """`seed` sets noise and magnetisation at power-up; `files` maps paths on the board to files to put there.

        romfs_kib: size of the ROMFS partition of the board's firmware; 0: none, as in stock firmware. frozen: a build
        folder whose modules and main program stand in for those frozen into the firmware. wrap_s: board time in s at
        which time.ticks_us and ticks_ms, which end at 2^30, begin at 0 again; 0: they begin with the power.
        Raises InputError for an unknown fault or pin, a missing interpreter or files that do not fit.
        """
        self.world: Any = default_world(board) if world is None else world
        check_pins(board)
        self._board, self._seed, self._faults = board, check_seed(seed), check_faults(faults, sensors_of(board))
        self._image = (Path(flash_dir) / f"{board.name}.lfs2").resolve()
        self._files = files or {}
        self._romfs_kib, self._frozen, self._wrap_s = romfs_kib, frozen, wrap_s
        self._process: subprocess.Popen | None = None
        self.port = ""

    def __enter__(self) -> "Twin":
        micropython = find_micropython()
        make_image(self._image, self._board.filesystem_kib, self._files, micropython)
        try:
            self._start(Job(self._board, micropython, self._image, *self._in_firmware()))
            self.power_cycle()
        except BaseException:
            self.close()
            raise
        return self

    def _in_firmware(self) -> tuple[Path | None, Path | None]:
        """What another firmware than the stock one has: the files of the ROMFS partition and of frozen modules."""
        romfs = make_partition(self._image.with_suffix(".romfs"), self._romfs_kib) if self._romfs_kib else None
        frozen = make_frozen(self._image.with_suffix(".frozen"), Path(self._frozen)) if self._frozen else None
        return romfs, frozen

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _start(self, job: Job) -> None:
        here, there = socket.socketpair()
        paths = [str(Path(barberpole.__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
        command = [sys.executable, "-c", "from barberpole.twin.process import main; main()"]
        self._process = subprocess.Popen(command, stdin=there.fileno(), env=environment)
        there.close()
        self._control = Connection(here.detach())
        self._control.send(job)
        self.port = self._ask("port")

    def close(self) -> None:
        """Switch off and remove the port."""
        process, self._process = self._process, None
        if process is None:
            return
        self._control.close()
        try:
            process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def power_cycle(
        self,
        world: AnyWorld | None = None,
        seed: int | None = None,
        faults: Iterable[str] | None = None,
        cut_s: float = math.inf,
    ) -> None:
        """Off and on again: same flash, fresh chips, new magnetisation; what is given replaces what it was.

        cut_s: board time in s at which the power goes away again, until the next call.
        """
        self.world = self.world if world is None else world
        self._seed = self._seed if seed is None else check_seed(seed)
        self._faults = self._faults if faults is None else check_faults(faults, sensors_of(self._board))
        self._ask("power_on", Power(self.world, self._seed, self._faults, cut_s, self._wrap_s))

    def kill(self) -> None:
        """Pull the plug now; the board stays off until `power_cycle`."""
        self._ask("power_off")

    @property
    def is_on(self) -> bool:
        """Whether the board has power."""
        return self._ask("pid") != 0

    def truth(self) -> dict:
        """What the board cannot know: today's parameters (LSB, µT, mA), state, faults, incidents.

        scale_lsb_per_ut (at zero field and this temperature), bias_lsb, offset_lsb, noise_lsb (rms of one average of
        samples_per_half conversions) are per axis; coil_ut_per_ma[i][j] is the field on die i of the coil j. Of an
        array all this stands in `sensors`, by name.
        """
        return self._ask("truth")

    def virtual_time_s(self) -> float:
        """Board time since power-up, as of its last request."""
        return self._ask("time")

    def start_s(self) -> float:
        """Board time at which the running program was started: 0 after power-up, later after a reset."""
        return self._ask("start")

    def wait_until(self, t_s: float, timeout_s: float = 60.0) -> None:
        """Wait for board time t_s. Raises PortError when it does not come within timeout_s of real time.

        Board time stands still at the prompt, and while more than a megabyte of output waits for a reader.
        """
        until = time.monotonic() + timeout_s
        while (now_s := self.virtual_time_s()) < t_s:
            if time.monotonic() > until or not self.is_on:
                be = f"at {t_s:g} s within {timeout_s:g} s"
                raise PortError(must("the board's clock", be, f"{now_s:g} s", self.port))
            time.sleep(POLL_S)

    @property
    def log_text(self) -> str:
        """All that the board has said since it was made (the last eight megabytes)."""
        return self.said_since(0)

    def said(self) -> int:
        """How many bytes the board has said since it was made."""
        return self._ask("said")

    def said_since(self, said: int) -> str:
        """What the board has said after its first `said` bytes."""
        return self._ask("log", said)

    def _ask(self, command: str, argument: object = None):
        if self._process is None:
            raise InputError(must("the emulated board", "used inside its with statement", "a closed one"))
        try:
            self._control.send((command, argument))
            if self._control.poll(ANSWER_S):
                return self._control.recv()
        except (EOFError, OSError):
            pass
        raise PortError(must("the emulated board", "alive", "no answer", self.port))


def check_seed(seed: int) -> int:
    """The seed. Raises InputError where it is negative."""
    if seed < 0:
        raise InputError(must("the seed", "0 or more", seed))
    return seed
