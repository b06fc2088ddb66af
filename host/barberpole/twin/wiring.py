"""The roles of an emulated board behind one face: a sensor board, with one sensor or an array, or a coil driver."""

from typing import Protocol

from barberpole.board import Board
from barberpole.driver_board import Driver
from barberpole.errors import InputError, must
from barberpole.twin.array_world import ArrayWorld
from barberpole.twin.driven import CoilWorld, Wired
from barberpole.twin.frames import Ahead
from barberpole.twin.soldered import Soldered
from barberpole.twin.world import World

AnyBoard = Board | Driver
AnyWorld = World | ArrayWorld | CoilWorld


class Wiring(Protocol):
    """Everything on a board but its microcontroller. Times are µs since power-up."""

    def pin(self, t_us: int, pin: int, level: int) -> None:
        """An output of the microcontroller has changed."""
        ...

    def release_pins(self, t_us: int) -> None:
        """The microcontroller resets: its pins float."""
        ...

    def transfer(self, t_us: int, bus: int, data: bytes) -> bytes:
        """Bytes over an SPI bus."""
        ...

    def ready_at(self, t_us: int) -> int:
        """When the converter's data-ready goes low."""
        ...

    def ahead(self, most: int) -> Ahead:
        """Up to `most` frames that the converter will say next; none where that cannot be told."""
        ...

    def take(self, count: int) -> None:
        """The program has read so many of the frames of the last `ahead`, each in its time. May charge for them."""
        ...

    def take_charge_us(self) -> int:
        """Time that arithmetic has taken since the last call."""
        ...

    def truth(self, t_us: int) -> dict:
        """What is hidden."""
        ...


def wired(board: AnyBoard, world: AnyWorld, seed: int, power_up: int, faults: frozenset[str]) -> Wiring:
    """The board's parts in their world. Raises InputError where the two are of different roles."""
    if isinstance(board, Driver) and isinstance(world, CoilWorld):
        return Wired(board, world, seed, power_up, faults)
    if isinstance(board, Board) and isinstance(world, ArrayWorld if board.members else World):
        return Soldered(board, world, seed, power_up, faults)
    raise InputError(must("the world", "one of the board's role", type(world).__name__, board.name))


def default_world(board: AnyBoard) -> AnyWorld:
    """The believable specimen."""
    if isinstance(board, Driver):
        return CoilWorld()
    return ArrayWorld.of(board) if board.members else World.of(board)


def sensors_of(board: AnyBoard) -> int:
    """How many sensors are on a board."""
    return board.in_series if isinstance(board, Board) else 0
