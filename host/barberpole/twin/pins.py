"""Names of the pyboard's pins, in the order that numbers them between interpreter and emulator."""

from barberpole.board import Board
from barberpole.driver_board import Driver
from barberpole.errors import InputError, must

PINS = (
    *(f"X{i}" for i in (*range(1, 13), *range(17, 23))),
    *(f"Y{i}" for i in range(1, 13)),
    *("P2", "P3", "P4", "P5", "P18", "SW", "LED_RED", "LED_GREEN", "LED_YELLOW", "LED_BLUE"),
)
PARTS = ("ads131m08", "dac80504")
"""Converters that are emulated."""
SPI_CLOCK_HZ = {1: 84_000_000, 2: 42_000_000}
"""Clock before the prescaler of each SPI: APB2 and APB1 of the STM32F405."""


def check_pins(board: Board | Driver) -> None:
    """Raises InputError where the board file uses a part, a pin or a bus that the emulated pyboard does not have."""
    if (board.adc.part, board.dac.part) != PARTS:
        be = f"one with the {PARTS[0]} and the {PARTS[1]} and with flips timed by the program, like pybv11"
        raise InputError(must("the emulated board", be, f"{board.adc.part} and {board.dac.part}", board.name))
    adc, dac = board.adc, board.dac
    flip: tuple[str, ...] = ()
    if isinstance(board, Board):
        flip = (board.flip.set_pin, board.flip.reset_pin, *(member.cs_pin for member in board.members[1:]))
    for pin in (*flip, adc.cs_pin, adc.drdy_pin, adc.reset_pin, dac.cs_pin):
        if pin not in PINS:
            raise InputError(must("a pin of the emulated board", "one of the pyboard's", pin, board.name))
    for spi in (adc.spi, dac.spi):
        if spi not in SPI_CLOCK_HZ:
            raise InputError(must("an SPI bus of the emulated board", "1 or 2", spi, board.name))


def bus_number(spi: int, mode: int = 1) -> int:
    """How a bus in an SPI mode is numbered between interpreter and emulator; both converters speak mode 1 only."""
    return spi | mode << 4
