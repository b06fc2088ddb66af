"""host/docs/bring-up.md: the first real board at the oscilloscope, in order, with figures from the board files."""

from collections.abc import Iterator
from dataclasses import dataclass

from barberpole.board import Board, load_board
from barberpole.board_checks import scan_us, scans_per_half
from barberpole.mcu import load_pinout
from barberpole.strap import strap_decay, strap_mean_a, strap_peak_a, strap_power_mw
from barberpole.wiring import Use, uses

BOARDS = ("pybv11", "pybv11_timed", "nucleo_f446re", "stm32f4disc")
EARTH_UT = 50.0
SUPPLY_FRACTION = 0.95  # the firmware's, below which it says supply_low

INTRODUCTION = """# Bring-up: the first real board

No board has run this firmware yet. What could be proved without one is proved (registers, pulses, rings, faults: the
tests); what follows could not. Go from top to bottom, and stop where a figure does not come out. Written by `make docs`
from the board files; `barberpole board check BOARD` prints the pins.

You need an oscilloscope with two probes, a current probe or 0.1 Ω in the strap's path, a supply with a current limit,
and a compass. What comes before the row "strap supply" is done **without the strap supply**.
"""
TICK_NS = 83.3  # of TIM8 at 12 MHz
PROGRAM_US = 4  # estimated: what bytecode adds to a pulse
CLOSING = """
What nobody has measured, and where it would show: the skew between the timers at the start (about 2 µs, in the first
cycle, which is not used); how much longer than asked for the program's own pulses are (`timing = "software"`: the
upper figure is an estimate) and how late behind USB traffic; coupling of the pulse into the samples ("bridge output");
and the times of `[timing]` in the board file ("self-calibration").
"""


@dataclass(frozen=True)
class Step:
    """One look: what to connect to, what is expected, and how it is made to happen."""

    signal: str
    pin: str
    expected: str
    how: str


def bring_up() -> str:
    """Markdown: for each board a table of steps."""
    return "\n".join([INTRODUCTION, *(_section(load_board(name)) for name in BOARDS)]) + CLOSING


def steps(board: Board) -> list[Step]:
    """In order: nothing moves, then pulses alone, then current, then readings."""
    wired = {use.key: use for use in uses(board) if not use.key.endswith(".spi")}
    buses = [use for use in uses(board) if use.key.endswith(".spi")]
    return [
        *_at_rest(board, wired),
        *_pulses(board, wired),
        *_straps(board),
        *_converters(board, wired, buses),
        *_readings(board),
    ]


def _at(use: Use) -> str:
    return use.name if use.name == use.port else f"{use.name} ({use.port})"


def _at_rest(board: Board, wired: dict[str, Use]) -> Iterator[Step]:
    both = f"{_at(wired['flip.set_pin'])}, {_at(wired['flip.reset_pin'])}"
    yield Step("pulse inputs of the strap driver", both, "below 0.3 V, by their pull-downs", "reset held down")
    low = "low all the time, no spike as the firmware starts"
    yield Step(
        "the same", both, low, "single shot, trigger on a rising edge at 1 V, power on, firmware not yet flashed"
    )
    half_v = board.dac.vref_v * board.dac.gain / 2
    by = "the bias resistors, then by the converter" if board.dac.part == "stm32f4_dac" else "the converter's straps"
    coils = f"{half_v:g} V each by {by}, and 0 mA in every coil from power-up on"
    yield Step("coil outputs", _dac_pins(board), coils, "coils connected, supply limited to 20 mA")


def _dac_pins(board: Board) -> str:
    if board.dac.part == "stm32f4_dac":
        return ", ".join(_at(use) for use in uses(board) if use.key in ("dac.part", "dac.pwm_pin"))
    outputs = board.dac.channels
    return f"{board.dac.part} OUT{outputs.coil_x}, OUT{outputs.coil_y}, OUT{outputs.coil_z}"


def _pulses(board: Board, wired: dict[str, Use]) -> Iterator[Step]:
    flip = board.flip
    half_us = 0.5e6 / flip.rate_hz
    timed = flip.timing == "hardware"
    tick = f" ± {TICK_NS / 1e3:.2f} µs"
    width = f"{flip.pulse_us:g} µs{tick}" if timed else f"{flip.pulse_us:g} to {flip.pulse_us + PROGRAM_US:g} µs"
    spacing = f"{half_us:.6g} µs{tick}" if timed else f"{half_us:.6g} µs (more at times, by a row's arithmetic)"
    set_pin, reset_pin = _at(wired["flip.set_pin"]), _at(wired["flip.reset_pin"])
    yield Step("SET pulse", set_pin, f"3.3 V, {width}, {flip.rate_hz:g} a second", "flash, and let it stream")
    yield Step("RESET pulse", reset_pin, f"as SET, {spacing} after it; the first pulse is a RESET", "both probes")
    yield Step("both", f"{set_pin}, {reset_pin}", "never high together", "trigger on their AND for ten minutes")
    ends = "both low within a pulse, and they stay so"
    yield Step("both", f"{set_pin}, {reset_pin}", ends, "Ctrl-C, then a soft reset (Ctrl-D), then the reset button")
    if flip.break_pin:
        stops = "no pulse later than 1 µs; the log says flip_stopped"
        yield Step("kill loop", _at(wired["flip.break_pin"]), stops, "open the loop while it streams")


def _straps(board: Board) -> Iterator[Step]:
    flip, sensor = board.flip, board.sensor
    supply = f"{flip.strap_supply_v:g} V; {strap_power_mw(board):.3g} mW (C V² f)"
    yield Step("strap supply", "strap driver", supply, "now connect supply and straps, current limit 50 mA")
    shape = (
        f"{strap_peak_a(board):.2f} A peak (at least {sensor.strap_current_a:g} A), {strap_mean_a(board):.2f} A mean, "
        f"{strap_decay(board):.0%} left at the end; signs alternate"
    )
    yield Step("strap current", "current probe", shape, "trigger on the SET pulse")
    low_v = SUPPLY_FRACTION * flip.strap_supply_v
    yield Step("supply_low", "strap supply", f"the log says supply_low below {low_v:.3g} V", "turn the supply down")


def _converters(board: Board, wired: dict[str, Use], buses: list[Use]) -> Iterator[Step]:
    adc = board.adc
    for use in buses:
        if use.function.startswith("sck"):
            mbit = (adc.baud if use.key == "adc.spi" else board.dac.baud) / 1e6
            yield Step(use.function, _at(use), f"bursts, at most {mbit:g} MHz, idle low", "while it streams")
    if adc.part == "ads131m08":
        period = f"a falling edge every {1e6 / adc.sample_hz:g} µs"
        yield Step("data ready", _at(wired["adc.drdy_pin"]), period, "while it streams")
    if adc.part == "stm32f4_adc":
        clock = board.cpu_mhz / 8
        limit = load_pinout(board.micropython_board).mcu.adc_clock_max_mhz
        scans = f"{scans_per_half(board)} scans of {scan_us(board):.1f} µs in half a cycle"
        beats = f"{scans}, ADC clock {clock:g} MHz (at most {limit:g})"
        yield Step("charge kicks of the sampling", _at(wired["adc.channels.x"]), beats, "AC-coupled, 10 mV a division")
    feed = f"{board.sensor.bridge_v / 2:+.2f} and {-board.sensor.bridge_v / 2:+.2f} V against ground"
    direct = adc.part == "ads131m08"
    common = f"ends at {feed}, outputs at {adc.common_mode_v:g} V" if direct else "within the amplifiers' range"
    yield Step("bridge feed", "bridge ends", common, f"{board.sensor.bridge_ma:g} mA through each bridge")


def _readings(board: Board) -> Iterator[Step]:
    adc, sensor = board.adc, board.sensor
    settled = f"within its noise {board.flip.settle_us:g} µs after the pulse's end"
    yield Step("bridge output", "input of the converter or its amplifier", settled, "trigger on either pulse")
    signal_mv = sensor.sensitivity_mv_per_v_per_ut * sensor.bridge_v * EARTH_UT
    scale = f"{signal_mv:.2f} mV for {EARTH_UT:g} µT, {board.scale_lsb_per_ut * EARTH_UT:.4g} LSB"
    yield Step("SET and RESET readings", "`record`", f"differ in sign; {scale}", "turn the sensor in the Earth's field")
    current_ma = max(board.selfcal.radii_ut) / sensor.offset_coil_ut_per_ma
    shunt = f"steps up to {current_ma:.2f} mA, {current_ma * adc.coil_shunt_ohm:.0f} mV at {adc.coil_shunt_ohm:g} Ω"
    yield Step("coil currents", "shunts", shunt, "single shot at power-up")
    run = board.selfcal
    seconds = run.points * (run.settle_cycles + run.cycles_per_point) / board.flip.rate_hz
    total = seconds + 1e-6 * run.points * board.timing.python_us_per_selfcal_point
    yield Step("self-calibration", "`pull`, `verify`", f"accepted after about {total:.1f} s", "power-up")


def _section(board: Board) -> str:
    rows = [f"## {board.name}\n", "| step | signal | where | expected | how |", "|---|---|---|---|---|"]
    for number, step in enumerate(steps(board), 1):
        rows.append(f"| {number} | {step.signal} | {step.pin} | {step.expected} | {step.how} |")
    return "\n".join(rows) + "\n"
