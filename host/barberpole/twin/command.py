"""What `barberpole twin BOARD` does: an emulated board until Ctrl-C."""

import contextlib
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from types import FrameType

from barberpole.arrays.array_file import load_array_board
from barberpole.arrays.names import is_array
from barberpole.board import load_board
from barberpole.driver_board import is_driver, load_driver
from barberpole.imcs.driven import read_driven
from barberpole.twin.ambient import Stations
from barberpole.twin.api import Twin
from barberpole.twin.array_world import ArrayWorld
from barberpole.twin.driven import CoilWorld
from barberpole.twin.world import World

ALIVE_S = 0.5
COIL_HOURS = 0.5
DEFAULT_HIDDEN = ("cross_field",)


def run_twin(
    board_name: str,
    hidden: Iterable[str] = (),
    seed: int = 0,
    flash_dir: str | Path | None = None,
    faults: Iterable[str] = (),
    romfs_kib: int = 0,
    frozen: str | Path | None = None,
    coils: str | Path | None = None,
    gradient_nt_per_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
    say: Callable[[str], None] = print,
) -> None:
    """Start the board, `say` its port, and keep it until Ctrl-C or SIGTERM.

    hidden: effects of world.HIDDEN ("none": an ideal sensor; empty: its cross-field effect). flash_dir: where the
    flash image is kept; None: nowhere, the board starts empty. romfs_kib, frozen: as of Twin.
    gradient_nt_per_m: around an array, along its first baseline.
    coils: record of a coil driver whose field the board lies in, over and over. Raises BarberpoleError.
    """
    if is_driver(board_name):
        board, world = load_driver(board_name), CoilWorld()
    elif is_array(board_name):
        board = load_array_board(board_name)
        around = in_coils(coils) if coils else None
        world = ArrayWorld.of(board, tuple(hidden) or DEFAULT_HIDDEN, around, gradient_nt_per_m)
    else:
        board = load_board(board_name)
        around = {"ambient": in_coils(coils)} if coils else {}
        world = World.of(board, tuple(hidden) or DEFAULT_HIDDEN, **around)
    with contextlib.ExitStack() as stack:
        folder = flash_dir or stack.enter_context(tempfile.TemporaryDirectory(prefix="barberpole-twin-"))
        signal.signal(signal.SIGTERM, _stop)
        with contextlib.suppress(KeyboardInterrupt):
            twin = stack.enter_context(Twin(board, folder, world, seed, faults, None, romfs_kib, frozen))
            say(twin.port)
            sys.stdout.flush()
            while True:
                time.sleep(ALIVE_S)
                twin.virtual_time_s()  # raises when the board is gone


def in_coils(record: str | Path) -> Stations:
    """The field in a coil driver's coils, as its record tells, repeated for COIL_HOURS. Raises InputError."""
    held = read_driven(record)
    field_ut = (held.ut_per_ma[:, None] * held.current_ma).T.tolist()
    until_s = [*held.from_s[1:].tolist(), float(held.from_s[-1]) + held.pitch_s]
    turn = [(end - begin, *b) for begin, end, b in zip(held.from_s.tolist(), until_s, field_ut, strict=True)]
    turns = round(3600.0 * COIL_HOURS / (until_s[-1] - float(held.from_s[0])))
    return Stations(tuple(turn) * turns)


def _stop(signum: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt
