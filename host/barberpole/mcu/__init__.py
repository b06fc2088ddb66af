"""What a microcontroller's pins and DMA streams can do, and how MicroPython's boards name their pins: data beside this.

`stm32f405.toml` and its like hold the alternate functions of the data sheet; `PYBV11.toml` and its like a board's pins,
buses, and what it uses itself. A further board is one more file here.
"""

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from barberpole.errors import InputError, must

FOLDER = Path(__file__).parent
PIN_DIGITS = 2  # of a pin within its port


@dataclass(frozen=True)
class Mcu:
    """A microcontroller family."""

    name: str
    parts: tuple[str, ...]
    """Beginnings of part numbers."""
    adc_clock_max_mhz: float
    hardware_flips: bool
    """Whether TIM8 can set TIM2 back, as the hardware-timed flips need it."""
    alternate: dict[str, dict[str, int]]
    """{"TIM8_CH1": {"PC6": 3}}: pins of a function, each with the number of its alternate function."""
    analog: dict[str, int]
    """Pin -> input of ADC1."""
    dac: dict[str, int]
    """Pin -> output of the DAC."""
    dma: dict[str, tuple[str, ...]]
    """Streams by user: those that ADC1 may use, those that MicroPython takes for a bus."""

    def functions(self, pin: str, prefix: str) -> dict[str, int]:
        """Functions of a pin that begin with `prefix`, with the number of the alternate function."""
        return {name: at[pin] for name, at in self.alternate.items() if name.startswith(prefix) and pin in at}


@dataclass(frozen=True)
class Pinout:
    """A MicroPython board."""

    name: str
    mcu: Mcu
    pins: dict[str, str]
    """Board name -> port pin."""
    port_prefix: str
    """How a pin without a name of its own is called: "P" for PC8; without it C8, MicroPython's name for it."""
    ports: dict[str, int]
    """Pins of each port."""
    spi: dict[int, dict[str, str]]
    """Bus number -> {"sck": "PA5", ...}."""
    taken: dict[str, str]
    """Port pin -> what the board itself uses it for."""
    timers: dict[str, str]
    """Timer -> what takes it unasked."""

    def port(self, name: str) -> str | None:
        """The port pin of a board's or a port's name, None where there is none."""
        if name in self.pins:
            return self.pins[name]
        bare = name.removeprefix(self.port_prefix)
        letter, number = bare[:1], bare[1:]
        few = number.isdecimal() and len(number) <= PIN_DIGITS  # Python refuses to count thousands of digits
        known = self.port_prefix + bare == name and few and int(number) < self.ports.get(letter, 0)
        return f"P{letter}{int(number)}" if known else None

    def label(self, port: str) -> str:
        """The board's own name of a port pin."""
        return next((name for name, at in self.pins.items() if at == port), self.port_prefix + port[1:])


def pinouts() -> list[str]:
    """Names of the MicroPython boards that are known."""
    return sorted(path.stem for path in FOLDER.glob("*.toml") if path.stem.isupper())


@cache
def load_pinout(name: str) -> Pinout:
    """A MicroPython board by name. Raises InputError where it is not known."""
    if name not in pinouts():
        raise InputError(must("board.micropython_board", f"one of {', '.join(pinouts())}", repr(name)))
    data = tomllib.loads((FOLDER / f"{name}.toml").read_text())
    buses = {int(number): pins for number, pins in data["spi"].items()}
    return Pinout(
        name,
        load_mcu(data["mcu"]),
        data["pins"],
        data["port_prefix"],
        data["ports"],
        buses,
        data["taken"],
        data["timers"],
    )


@cache
def load_mcu(name: str) -> Mcu:
    """A microcontroller family by the name of its file."""
    data = tomllib.loads((FOLDER / f"{name}.toml").read_text())
    base = load_mcu(data["same_as"]) if "same_as" in data else None
    alternate = {function: dict(pins) for function, pins in base.alternate.items()} if base else {}
    for function, pins in data["alternate"].items():
        alternate.setdefault(function, {}).update(pins)
    return Mcu(
        data["name"],
        tuple(data["parts"]),
        base.adc_clock_max_mhz if base else data["adc_clock_max_mhz"],
        base.hardware_flips if base else data["hardware_flips"],
        alternate,
        base.analog if base else data["analog"],
        base.dac if base else data["dac"],
        base.dma if base else {user: tuple(streams) for user, streams in data["dma"].items()},
    )
