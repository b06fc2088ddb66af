"""Names of the pyboard's pins, in the order that numbers them between interpreter and emulator."""

PINS = (
    *(f"X{i}" for i in (*range(1, 13), *range(17, 23))),
    *(f"Y{i}" for i in range(1, 13)),
    *("P2", "P3", "P4", "P5", "P18", "SW", "LED_RED", "LED_GREEN", "LED_YELLOW", "LED_BLUE"),
)
SPI_CLOCK_HZ = {1: 84_000_000, 2: 42_000_000}
"""Clock before the prescaler of each SPI: APB2 and APB1 of the STM32F405."""


def bus_number(spi: int, mode: int = 1) -> int:
    """How a bus in an SPI mode is numbered between interpreter and emulator; both converters speak mode 1 only."""
    return spi | mode << 4
