"""Whether a board's parts can do what its file asks of them: pins, pulses, times, currents, ranges.

Each check raises LimitError (InputError for pins and channels) with the figures on both sides; `where` names the file.
"""

from collections.abc import Callable, Mapping

from barberpole.board_tables import Board
from barberpole.errors import InputError, LimitError, must

FULL_SCALE_TOLERANCE = 0.01  # resistors of one per cent
HOT_C = 85.0  # the bridge voltage is largest there
T0_C = 25.0
CHANNELS = {"ads131m08": 8, "dac80504": 4}


def check_board(board: Board, where: object = "") -> None:
    """All checks, in the order of the file."""
    for check in CHECKS:
        check(board, where)


def strap_power_mw(board: Board) -> float:
    """Power of flipping in mW: C V² f (thesis 3.4.3)."""
    flip = board.flip
    return flip.capacitor_nf * 1e-9 * flip.strap_supply_v**2 * flip.rate_hz * 1e3


def strap_peak_a(board: Board) -> float:
    """Peak of the pulse in A: the three straps in series across the supply."""
    return board.flip.strap_supply_v / (3.0 * board.sensor.strap_ohm)


def _pins(board: Board, where: object) -> None:
    pins = {
        "flip.set_pin": board.flip.set_pin,
        "flip.reset_pin": board.flip.reset_pin,
        "adc.cs_pin": board.adc.cs_pin,
        "adc.drdy_pin": board.adc.drdy_pin,
        "adc.reset_pin": board.adc.reset_pin,
        "dac.cs_pin": board.dac.cs_pin,
    }
    _distinct(pins, "pin", where)


def _channels(board: Board, where: object) -> None:
    for table, part, channels in (
        ("adc", board.adc.part, vars(board.adc.channels)),
        ("dac", board.dac.part, vars(board.dac.channels)),
    ):
        named = {f"{table}.channels.{k}": v for k, v in channels.items() if not k.startswith("_")}
        _distinct(named, "channel", where)
        for name, channel in named.items():
            if channel >= CHANNELS[part]:
                raise InputError(must(name, f"at most {CHANNELS[part] - 1} on the {part}", channel, where))


def _distinct(used: Mapping[str, object], kind: str, where: object) -> None:
    first: dict[object, str] = {}
    for name, value in used.items():
        if value in first:
            raise InputError(must(name, f"a {kind} of its own", f"{value}, which is also {first[value]}", where))
        first[value] = name


def _pulse(board: Board, where: object) -> None:
    _at_least("flip.pulse_us", board.flip.pulse_us, board.sensor.strap_pulse_us_min, "µs", "the strap needs it", where)


def _strap_current(board: Board, where: object) -> None:
    peak, needed = strap_peak_a(board), board.sensor.strap_current_a
    straps = f"three straps of {board.sensor.strap_ohm:g} Ω in series need it"
    _at_least(f"the pulse of {board.flip.strap_supply_v:g} V", peak, needed, "A", straps, where)


def _strap_power(board: Board, where: object) -> None:
    """Flipping must not heat the sensor more than its own supply does (thesis 3.4.3)."""
    bridges_mw = 3.0 * board.sensor.bridge_v * board.sensor.bridge_ma
    reason = "C V² f of flip.capacitor_nf, strap_supply_v and rate_hz; no more than the bridges themselves take"
    _at_most("the power of flipping", strap_power_mw(board), bridges_mw, "mW", reason, where)


def _half_cycle(board: Board, where: object) -> None:
    flip, adc = board.flip, board.adc
    needed_us = flip.pulse_us + flip.settle_us + adc.samples_per_half / adc.sample_hz * 1e6
    have_us = 0.5e6 / flip.rate_hz
    reason = "pulse_us + settle_us + samples_per_half / sample_hz within half a cycle of rate_hz"
    _at_most("a half cycle's work", needed_us, have_us, "µs", reason, where)


def _adc_range(board: Board, where: object) -> None:
    sensor, adc = board.sensor, board.adc
    signal_mv_per_v = sensor.sensitivity_mv_per_v_per_ut * sensor.range_ut + abs(sensor.offset_mv_per_v)
    full_mv = 1000.0 * adc.vref_v / adc.pga
    reason = f"signal of ±{sensor.range_ut:g} µT with offset, within the converter at adc.pga {adc.pga}"
    _at_most("the bridge signal", sensor.bridge_v * signal_mv_per_v, full_mv, "mV", reason, where)


def _divided_voltages(board: Board, where: object) -> None:
    adc, sensor = board.adc, board.sensor
    hot = 1.0 + sensor.bridge_tempco_per_c * (HOT_C - T0_C)
    at_bridge, at_supply = "the bridge voltage at its input", "the strap supply at its input"
    hot_v = sensor.bridge_v * hot * adc.bridge_divider
    _at_most(at_bridge, hot_v, adc.vref_v, "V", f"through adc.bridge_divider, at {HOT_C:g} °C", where)
    supply_v = board.flip.strap_supply_v * adc.supply_divider
    _at_most(at_supply, supply_v, adc.vref_v, "V", "through adc.supply_divider", where)


def _dac_range(board: Board, where: object) -> None:
    """Full scale is half the DAC's span over coil, shunt and series resistor."""
    half_mv = 500.0 * board.dac.vref_v * board.dac.gain
    ohm = board.sensor.offset_coil_ohm + board.adc.coil_shunt_ohm + board.coils.series_ohm
    for axis, full in zip(board.sensor.axes, board.coils.full_scale_ma, strict=True):
        if abs(full - half_mv / ohm) > FULL_SCALE_TOLERANCE * full:
            ohms = f"{ohm:g} Ω of coil, shunt and series resistor"
            be = f"{half_mv / ohm:.3g} mA, the DAC's ±{half_mv / 1000:g} V over {ohms}"
            raise LimitError(must(f"coils.full_scale_ma of {axis}", be, f"{full:g} mA", where))


def _coil_current(board: Board, where: object) -> None:
    coils = board.coils
    _at_most(
        "coils.max_ma", coils.max_ma, board.sensor.offset_coil_max_ma, "mA", "the offset coil bears no more", where
    )
    _at_most("coils.max_ma", coils.max_ma, min(coils.full_scale_ma), "mA", "the DAC reaches no further", where)
    shunt_v = coils.max_ma * board.adc.coil_shunt_ohm / 1000.0
    _at_most("the shunt voltage at coils.max_ma", shunt_v, board.adc.vref_v, "V", "range of its input", where)


def _radii(board: Board, where: object) -> None:
    radius = max(board.selfcal.radii_ut)
    _at_most("selfcal.radii_ut", radius, board.sensor.range_ut, "µT", "range of the sensor", where)
    current_ma = radius / board.sensor.offset_coil_ut_per_ma
    reason = f"coils.max_ma; a radius of {radius:g} µT takes it"
    _at_most("the coil current of the self-calibration", current_ma, board.coils.max_ma, "mA", reason, where)


def _coil_settling(board: Board, where: object) -> None:
    if board.selfcal.settle_cycles == 0:
        reason = "flip.settle_us, since selfcal.settle_cycles is 0"
        _at_most("coils.settle_us", board.coils.settle_us, board.flip.settle_us, "µs", reason, where)


def _at_most(what: str, value: float, limit: float, unit: str, reason: str, where: object) -> None:
    if value > limit * (1 + 1e-9):  # rounding is no fault
        raise LimitError(must(what, f"at most {limit:.4g} {unit} ({reason})", f"{value:.4g} {unit}", where))


def _at_least(what: str, value: float, limit: float, unit: str, reason: str, where: object) -> None:
    if value < limit * (1 - 1e-9):
        raise LimitError(must(what, f"at least {limit:.4g} {unit} ({reason})", f"{value:.4g} {unit}", where))


CHECKS: tuple[Callable[[Board, object], None], ...] = (
    _pins,
    _channels,
    _pulse,
    _strap_current,
    _strap_power,
    _half_cycle,
    _adc_range,
    _divided_voltages,
    _dac_range,
    _coil_current,
    _radii,
    _coil_settling,
)
