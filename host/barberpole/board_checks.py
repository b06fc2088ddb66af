"""Whether a board's parts can do what its file asks of them: pins, pulses, times, currents, ranges.

Each check raises LimitError (InputError for pins and channels) with the figures on both sides; `where` names the file.
"""

from collections.abc import Callable, Mapping

from barberpole import wiring
from barberpole.board_tables import Board
from barberpole.errors import BarberpoleError, InputError, LimitError, must
from barberpole.mcu import load_pinout
from barberpole.strap import strap_decay, strap_ohm, strap_peak_a, strap_power_mw

FULL_SCALE_TOLERANCE = 0.01  # resistors of one per cent
HOT_C = 85.0  # the bridge voltage is largest there
T0_C = 25.0
CHANNELS = {"ads131m08": 8, "ads8688": 8, "stm32f4_adc": 16, "dac80504": 4, "stm32f4_dac": 3}
BITS = {"ads131m08": 24, "ads8688": 16, "stm32f4_adc": 12, "dac80504": 16, "stm32f4_dac": 12}
SPANS_V = {"ads8688": (2.56, 5.12, 10.24)}
"""Full scales at gain 1, where a part offers a few (SBAS582, 8.3.2: 0.625, 1.25 and 2.5 times 4.096 V)."""
M08_LOWEST_V, M08_HIGHEST_V, M08_HEADROOM_V = -1.3, 3.3, 1.8
"""Absolute inputs of the ADS131M08 (SBAS950B, 6.3): -1.3 V to AVDD, at gains of 8 and more to AVDD - 1.8 V."""
RING_CYCLES = 20
"""Fewest: 12 ms of the collector and as much of USB at 1 kHz."""
RING_HALFWORDS = 65535
SCAN_INPUTS, SCAN_CLOCKS, ADC_DIVIDER = 8, 40, 4
"""A scan of the on-chip converter: inputs, clocks of one (28 sampling, 12 converting); its clock is PCLK2 / 4."""


FRAME_BITS, FRAME_PROGRAM_US = 240, 40.0
"""A frame of the ADS131M08 (status, eight channels, check sum of 24 bits), and bytecode around it, estimated."""
_COUNT = {3: "three", 6: "six"}


def check_board(board: Board, where: object = "") -> None:
    """All checks, in the order of the file."""
    for check in CHECKS:
        check(board, where)


def faults(board: Board) -> list[str]:
    """Everything that is wrong, each as one sentence; a check that finds nothing to look at stays silent."""
    found = wiring.conflicts(board)
    for check in CHECKS[1:]:
        try:
            check(board, "")
        except BarberpoleError as error:
            found.append(str(error))
    return found


def scan_us(board: Board) -> float:
    """µs of one scan of the on-chip converter."""
    return SCAN_INPUTS * SCAN_CLOCKS * ADC_DIVIDER / (board.cpu_mhz / 2.0)


def scans_per_half(board: Board) -> int:
    """Scans of the on-chip converter in half a flip cycle."""
    return round(board.adc.sample_hz / (2.0 * board.flip.rate_hz))


def _wiring(board: Board, where: object) -> None:
    for conflict in wiring.conflicts(board):
        raise InputError(f"{conflict} ({where})" if where else conflict)


def _bits(board: Board, where: object) -> None:
    for table, part, bits in (("adc", board.adc.part, board.adc.bits), ("dac", board.dac.part, board.dac.bits)):
        if bits != BITS[part]:
            raise InputError(must(f"{table}.bits", f"{BITS[part]}, those of the {part}", bits, where))
    spans = SPANS_V.get(board.adc.part)
    if spans and board.adc.vref_v not in spans:
        known = ", ".join(f"{v:g}" for v in spans)
        raise LimitError(
            must("adc.vref_v", f"a full scale of the {board.adc.part} ({known} V)", board.adc.vref_v, where)
        )


def _common_mode(board: Board, where: object) -> None:
    """The converter sees each end of a bridge against its own ground, not only their difference."""
    if board.adc.part != "ads131m08":
        return  # amplifiers stand before the others
    swing_v = 0.5 * board.adc.vref_v / board.adc.pga
    highest_v = M08_HIGHEST_V - (M08_HEADROOM_V if board.adc.pga >= 8 else 0.0)
    what, reason = "adc.common_mode_v with half the signal", f"absolute input range at adc.pga {board.adc.pga}"
    feed = f"{reason}; feed the bridges symmetrically about ground"
    _at_most(what, board.adc.common_mode_v + swing_v, highest_v, "V", feed, where)
    _at_least(what, board.adc.common_mode_v - swing_v, M08_LOWEST_V, "V", reason, where)


def _ring(board: Board, where: object) -> None:
    """Scans must end before the next begins, and enough cycles must fit into one transfer of DMA."""
    if board.flip.timing != "hardware":
        return
    limit = load_pinout(board.micropython_board).mcu.adc_clock_max_mhz
    _at_most("the converter's clock", board.cpu_mhz / 2.0 / ADC_DIVIDER, limit, "MHz", "PCLK2 / 4", where)
    reason = f"a scan of {SCAN_INPUTS} inputs takes {scan_us(board):.1f} µs and has to leave a tenth"
    _at_most("adc.sample_hz", board.adc.sample_hz, 0.9e6 / scan_us(board), "Hz", reason, where)
    _at_least("adc.ring_cycles", board.adc.ring_cycles, RING_CYCLES, "", "pauses of collector and USB", where)
    halfwords = 2 * scans_per_half(board) * SCAN_INPUTS * board.adc.ring_cycles
    _at_most("the ring", halfwords, RING_HALFWORDS, "codes", "one transfer of DMA", where)
    _at_most("the ring", 2 * halfwords, 256 * board.ram_kib, "bytes", "a quarter of board.ram_kib", where)


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
    flip = board.flip
    count = _COUNT.get(3 * board.in_series, 3 * board.in_series)
    straps = (
        f"{count} straps of {board.sensor.strap_ohm:g} Ω in series need it; {strap_decay(board):.0%} of a pulse's "
        f"current is left after {flip.pulse_us:g} µs through {flip.capacitor_nf:g} nF and {strap_ohm(board):.3g} Ω"
    )
    _at_least(f"the pulse of {flip.strap_supply_v:g} V", peak, needed, "A", straps, where)


def _strap_power(board: Board, where: object) -> None:
    """Flipping must not heat the sensor more than its own supply does (thesis 3.4.3)."""
    bridges_mw = 3.0 * board.in_series * board.sensor.bridge_v * board.sensor.bridge_ma
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
    coils_ohm = board.in_series * board.sensor.offset_coil_ohm
    ohm = coils_ohm + board.adc.coil_shunt_ohm + board.coils.series_ohm
    for axis, full in zip(board.sensor.axes, board.coils.full_scale_ma, strict=True):
        if abs(full - half_mv / ohm) > FULL_SCALE_TOLERANCE * full:
            coil = f"{board.in_series} coils in series" if board.in_series > 1 else "coil"
            ohms = f"{ohm:g} Ω of {coil}, shunt and series resistor"
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
    else:
        settled_us = board.selfcal.settle_cycles * 1e6 / board.flip.rate_hz
        reason = f"selfcal.settle_cycles of {board.flip.rate_hz:g} Hz"
        _at_most("coils.settle_us", board.coils.settle_us, settled_us, "µs", reason, where)


def _converters(board: Board, where: object) -> None:
    """An array has a converter for each sensor; all are read within one conversion."""
    if not board.members:
        return
    if board.adc.part != "ads131m08":
        raise InputError(must("adc.part", "ads131m08, whose chips keep step, on an array", board.adc.part, where))
    first = board.members[0]
    if first.cs_pin:
        raise InputError(must("cs_pin of the first sensor", "left to adc.cs_pin", repr(first.cs_pin), where))
    needed_us = board.in_series * (FRAME_BITS * 1e6 / board.adc.baud + FRAME_PROGRAM_US)
    reason = f"a conversion of adc.sample_hz, in which {board.in_series} converters are read at adc.baud"
    _at_most("the frames' time", needed_us, 1e6 / board.adc.sample_hz, "µs", reason, where)


def _at_most(what: str, value: float, limit: float, unit: str, reason: str, where: object) -> None:
    if value > limit * (1 + 1e-9):  # rounding is no fault
        unit = f" {unit}" if unit else ""
        raise LimitError(must(what, f"at most {limit:.4g}{unit} ({reason})", f"{value:.4g}{unit}", where))


def _at_least(what: str, value: float, limit: float, unit: str, reason: str, where: object) -> None:
    if value < limit - 1e-9 * abs(limit):
        unit = f" {unit}" if unit else ""
        raise LimitError(must(what, f"at least {limit:.4g}{unit} ({reason})", f"{value:.4g}{unit}", where))


CHECKS: tuple[Callable[[Board, object], None], ...] = (
    _wiring,
    _channels,
    _bits,
    _pulse,
    _strap_current,
    _strap_power,
    _half_cycle,
    _ring,
    _common_mode,
    _adc_range,
    _divided_voltages,
    _dac_range,
    _coil_current,
    _radii,
    _coil_settling,
    _converters,
)
