"""What `barberpole twin BOARD` does: an emulated board until Ctrl-C."""

import contextlib
import signal
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path
from types import FrameType

from barberpole.board import load_board
from barberpole.driver_board import is_driver, load_driver
from barberpole.twin.api import Twin
from barberpole.twin.driven import CoilWorld
from barberpole.twin.world import World

ALIVE_S = 0.5
DEFAULT_HIDDEN = ("cross_field",)


def run_twin(
    board_name: str,
    hidden: Iterable[str] = (),
    seed: int = 0,
    flash_dir: str | Path | None = None,
    faults: Iterable[str] = (),
    romfs_kib: int = 0,
    frozen: str | Path | None = None,
) -> None:
    """Start the board, print its port as the first line, and keep it until Ctrl-C or SIGTERM.

    hidden: effects of world.HIDDEN ("none": an ideal sensor; empty: its cross-field effect). flash_dir: where the
    flash image is kept; None: nowhere, the board starts empty. romfs_kib, frozen: as of Twin. Raises BarberpoleError.
    """
    if is_driver(board_name):
        board, world = load_driver(board_name), CoilWorld()
    else:
        board = load_board(board_name)
        world = World.of(board, tuple(hidden) or DEFAULT_HIDDEN)
    with contextlib.ExitStack() as stack:
        folder = flash_dir or stack.enter_context(tempfile.TemporaryDirectory(prefix="barberpole-twin-"))
        signal.signal(signal.SIGTERM, _stop)
        with contextlib.suppress(KeyboardInterrupt):
            twin = stack.enter_context(Twin(board, folder, world, seed, faults, None, romfs_kib, frozen))
            print(twin.port, flush=True)
            while True:
                time.sleep(ALIVE_S)
                twin.virtual_time_s()  # raises when the board is gone


def _stop(signum: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt
