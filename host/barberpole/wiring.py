"""What a board file takes of its microcontroller, pin by pin, and where two things want the same or a pin cannot.

`uses` lists pins with their functions; `conflicts` explains each thing that cannot work as one sentence.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from barberpole.board_tables import Adc, Board, Dac
from barberpole.errors import InputError, must
from barberpole.mcu import Pinout, load_pinout

ON_CHIP_ADC, ON_CHIP_DAC = "stm32f4_adc", "stm32f4_dac"
LINES = {"ads131m08": ("cs_pin", "drdy_pin", "reset_pin"), "ads8688": ("cs_pin",), "dac80504": ("cs_pin",)}
"""Pins that a part on SPI has beside the bus."""
FLIP_TIMERS = ("TIM8", "TIM2")
FLIP_STREAM = "DMA2 stream 0"
INPUTS = ("x", "y", "z", "bridge", "coil_x", "coil_y", "coil_z", "supply")


@dataclass(frozen=True)
class Use:
    """One pin in use: the key of the board file, the name there, the port pin, and what the pin does."""

    key: str
    name: str
    port: str
    function: str


def uses(board: Board) -> list[Use]:
    """All pins of the board file that exist, in its order; those of the buses with them."""
    pinout = load_pinout(board.micropython_board)
    return [Use(key, name, port, does) for key, name, does in _asked(board, pinout) if (port := pinout.port(name))]


def flip_channel(board: Board, pin: str) -> int:
    """Channel of TIM8 at a pin by its name, 0 where there is none."""
    pinout = load_pinout(board.micropython_board)
    found = pinout.mcu.functions(pinout.port(pin) or "", "TIM8_CH")
    return int(next(iter(found))[-1]) if found else 0


def adc_pins(board: Board) -> tuple[str, ...]:
    """Names of the on-chip converter's pins, in the order of `INPUTS`. Raises InputError for an input without a pin."""
    pinout = load_pinout(board.micropython_board)
    at = {number: port for port, number in pinout.mcu.analog.items()}
    found = []
    for name in INPUTS:
        number = getattr(board.adc.channels, name)
        if number not in at:
            be = f"an input of ADC1 that has a pin (0 to {max(at)})"
            raise InputError(must(f"adc.channels.{name}", be, number, board.name))
        found.append(pinout.label(at[number]))
    return tuple(found)


def dac_pins(board: Board) -> tuple[str, ...]:
    """Names of the on-chip converter's two outputs; empty for a part on SPI."""
    if board.dac.part != ON_CHIP_DAC:
        return ()
    pinout = load_pinout(board.micropython_board)
    return tuple(pinout.label(port) for port in pinout.mcu.dac)


def timer_output(board: Board, pin: str) -> tuple[str, int, int]:
    """Timer, channel and alternate function at a pin, other than the timers of the flips; ("", 0, 0) without one."""
    pinout = load_pinout(board.micropython_board)
    functions = pinout.mcu.functions(pinout.port(pin) or "", "TIM")
    for function, number in sorted(functions.items()):
        timer, _, channel = function.partition("_CH")
        if channel and timer not in FLIP_TIMERS and timer not in pinout.timers:
            return timer, int(channel), number
    return "", 0, 0


def conflicts(board: Board) -> list[str]:
    """Everything that cannot be wired or shared as the board file wants it, each as one sentence."""
    try:
        pinout = load_pinout(board.micropython_board)
    except InputError as error:
        return [str(error)]
    found = list(_parts(board, pinout))
    if not found:
        found += [*_missing_pins(board, pinout), *_shared_pins(board, pinout), *_buses(board, pinout)]
        found += [*_flip_pins(board, pinout), *_streams(board, pinout), *_timers(board, pinout)]
    return found


def _asked(board: Board, pinout: Pinout) -> Iterator[tuple[str, str, str]]:
    """(key, name, function) of every pin."""
    flip = board.flip
    yield "flip.set_pin", flip.set_pin, "SET pulse"
    yield "flip.reset_pin", flip.reset_pin, "RESET pulse"
    if flip.break_pin:
        yield "flip.break_pin", flip.break_pin, "kill loop"
    for table, chip in (("adc", board.adc), ("dac", board.dac)):
        for line in LINES.get(chip.part, ()):
            yield f"{table}.{line}", getattr(chip, line), f"{line.removesuffix('_pin')} of the {chip.part}"
    for member in board.members[1:]:
        yield f"cs_pin of {member.name}", member.cs_pin, f"cs of the {board.adc.part} of {member.name}"
    for table, number in _bus_numbers(board).items():
        for line, port in pinout.spi.get(number, {}).items():
            yield f"{table}.spi", pinout.label(port), f"{line} of SPI {number}"
    if board.adc.part == ON_CHIP_ADC:
        for name, pin in zip(INPUTS, adc_pins(board), strict=True):
            yield f"adc.channels.{name}", pin, f"ADC1 input {getattr(board.adc.channels, name)}"
    if board.dac.part == ON_CHIP_DAC:
        for port, output in pinout.mcu.dac.items():
            yield "dac.part", pinout.label(port), f"DAC output {output}"
        yield "dac.pwm_pin", board.dac.pwm_pin, "third coil, pulse-width modulated"


def _bus_numbers(board: Board) -> dict[str, int]:
    """{"adc": 1, "dac": 2}: the buses, each once."""
    found = {}
    for table, chip in (("adc", board.adc), ("dac", board.dac)):
        if chip.part in LINES and chip.spi not in found.values():
            found[table] = chip.spi
    return found


def _parts(board: Board, pinout: Pinout) -> Iterator[str]:
    """What must be there before pins can be looked at."""
    if not board.mcu.startswith(pinout.mcu.parts):
        yield must("board.mcu", f"the {pinout.mcu.name} of a {pinout.name}", board.mcu)
    timed, on_chip = board.flip.timing == "hardware", board.adc.part == ON_CHIP_ADC
    if timed != on_chip:
        be = f'"hardware" with the {ON_CHIP_ADC}, "software" with a converter on SPI'
        yield must("flip.timing", be, f'"{board.flip.timing}" with the {board.adc.part}')
    if board.flip.break_pin and not timed:
        yield must("flip.break_pin", 'empty with flip.timing = "software", which cannot obey it', board.flip.break_pin)
    for table, chip in (("adc", board.adc), ("dac", board.dac)):
        for line in LINES.get(chip.part, ()):
            if not getattr(chip, line):
                yield must(f"{table}.{line}", f"given for the {chip.part}", "nothing")
        if chip.part in LINES and (not chip.spi or not chip.baud):
            yield must(f"{table}.spi and {table}.baud", f"given for the {chip.part}", f"{chip.spi} and {chip.baud}")
    if on_chip:
        try:
            adc_pins(board)
        except InputError as error:
            yield str(error)


def _missing_pins(board: Board, pinout: Pinout) -> Iterator[str]:
    for key, name, _ in _asked(board, pinout):
        if pinout.port(name) is None:
            yield must(key, f"a pin of the {pinout.name}", repr(name))


def _shared_pins(board: Board, pinout: Pinout) -> Iterator[str]:
    first: dict[str, Use] = {}
    for use in uses(board):
        shown = use.name if use.name == use.port else f"{use.name} = {use.port}"
        if use.port in pinout.taken:
            yield must(use.key, f"a free pin for the {use.function}", f"{shown}, which is {pinout.taken[use.port]}")
        if use.port in first:
            other = first[use.port]
            yield must(use.key, "a pin of its own", f"{shown}, which is also {other.key} ({other.function})")
        first.setdefault(use.port, use)


def _buses(board: Board, pinout: Pinout) -> Iterator[str]:
    for table, chip in (("adc", board.adc), ("dac", board.dac)):
        if chip.part not in LINES:
            continue
        if chip.spi not in pinout.spi:
            known = ", ".join(map(str, pinout.spi))
            yield must(f"{table}.spi", f"one of the buses of a {pinout.name} ({known})", chip.spi)
            continue
        yield from _bus_lines(table, chip, pinout)
    if board.adc.part in LINES and board.adc.spi == board.dac.spi and board.adc.baud != board.dac.baud:
        be = f"adc.baud, {board.adc.baud}, as both are on SPI {board.adc.spi}"
        yield must("dac.baud", be, board.dac.baud)


def _bus_lines(table: str, chip: Adc | Dac, pinout: Pinout) -> Iterator[str]:
    """MicroPython fixes a bus's pins; a file that names others describes another board."""
    for line, port in pinout.spi[chip.spi].items():
        named = getattr(chip, f"{line}_pin")
        if named and pinout.port(named) != port:
            be = f"{pinout.label(port)} ({port}), which is {line} of SPI {chip.spi}"
            other = pinout.mcu.functions(pinout.port(named) or "", "SPI")
            yield must(f"{table}.{line}_pin", be, f"{named}, which is {' or '.join(other) or 'on no SPI'}")


def _flip_pins(board: Board, pinout: Pinout) -> Iterator[str]:
    if board.flip.timing != "hardware":
        return
    if not pinout.mcu.hardware_flips:
        yield must("flip.timing", f'"software" on the {pinout.mcu.name}', '"hardware"')
    channels = {}
    for key in ("set_pin", "reset_pin"):
        name = getattr(board.flip, key)
        channels[key] = flip_channel(board, name)
        if not channels[key] and pinout.port(name):
            able = sorted(pinout.label(p) for n in range(1, 5) for p in pinout.mcu.alternate[f"TIM8_CH{n}"])
            yield must(f"flip.{key}", f"a channel of TIM8 ({', '.join(able)})", name)
    port = pinout.port(board.flip.break_pin)
    if port and not pinout.mcu.functions(port, "TIM8_BKIN"):
        able = ", ".join(pinout.label(p) for p in pinout.mcu.alternate["TIM8_BKIN"])
        yield must("flip.break_pin", f"the break input of TIM8 ({able})", board.flip.break_pin)


def _streams(board: Board, pinout: Pinout) -> Iterator[str]:
    """The scans go through DMA2 stream 0. Another user of DMA2 would be switched off under them with it."""
    if board.flip.timing != "hardware":
        return
    for table, number in _bus_numbers(board).items():
        streams = pinout.mcu.dma.get(f"SPI{number}", ())
        if FLIP_STREAM in streams:
            yield must(f"{table}.spi", f"a bus beside {FLIP_STREAM}, which carries the samples", f"SPI {number}")
        elif any(stream.startswith("DMA2") for stream in streams):
            be = f"a bus on DMA1, since MicroPython stops DMA2 64 ms after its own last use and {FLIP_STREAM} with it"
            yield must(f"{table}.spi", be, f"SPI {number} ({', '.join(streams)})")


def _timers(board: Board, pinout: Pinout) -> Iterator[str]:
    if board.flip.timing == "hardware":
        for timer in FLIP_TIMERS:
            if timer in pinout.timers:
                yield must("flip.timing", f'"software", as {pinout.timers[timer]} takes {timer}', '"hardware"')
    pin = board.dac.pwm_pin
    if board.dac.part == ON_CHIP_DAC and pinout.port(pin) and not timer_output(board, pin)[0]:
        functions = ", ".join(pinout.mcu.functions(pinout.port(pin) or "", "TIM")) or "no timer's"
        busy = ", ".join([*FLIP_TIMERS, *pinout.timers])
        yield must("dac.pwm_pin", f"an output of a timer other than {busy}", f"{pin}, which is {functions}")
