"""Board, trajectory and calibration as the constants of the generated modules. No syntax here, only values."""

import hashlib
import math

import numpy as np
from barberpole.board import Board
from barberpole.calibration import Calibration
from barberpole.errors import LimitError, must
from barberpole.fitted import from_calibration
from barberpole.selfcal import slope_lsb_per_ut
from barberpole.trajectory import CodeTable

from barberpole_codegen import parts
from barberpole_codegen.emit import Constant, literal
from barberpole_codegen.functions import RowScales
from barberpole_codegen.narrow import narrow_number

SUPPLY_FRACTION = 0.95  # below this the pulse is weaker than the board was designed for
WIDE_DRIFT = 0.5  # without a factory reference gains are compared with nominal parts only
RESIDUALS = 3.0  # a coil run may be this much worse than the calibration was when it was fitted
EARTH_UT = 50.0  # a typical ambient field, on top of which the coils are driven
CURVATURE = 3  # the lowest odd power a bridge's law can miss
OWN_OFFSET = ("bias.bridge_", "flip_asymmetry.offset_")  # parameters that are the electronic offset
CONVERSIONS = 2  # of a channel other than the bridges' in a cycle: one after SET, one after RESET
CONVERTER_NOISE_LSB = {"ads8688": 0.5, "stm32f4_adc": 1.0}
"""rms of one conversion with its rounding: 92 dB (SBAS582); of a 12-bit converter beside a processor, estimated."""
T0_C = 25.0  # at which the sensor file gives the bridge resistance


def board_constants(board: Board) -> list[Constant]:
    """What is soldered, in the firmware's units; the last constant is the hash of all others."""
    constants = [*_names(board), *_flip(board), *_adc(board), *_dac(board), *_selfcal(board), *_members(board)]
    return [*constants, Constant("HASH", digest(constants), "of all of the above")]


def trajectory_constants(table: CodeTable) -> list[Constant]:
    """The run of coil currents."""
    return [
        Constant("ID", table.id),
        Constant("NAME", table.name),
        Constant("POINTS", table.points),
        Constant("BLOCK", table.block, "points after which every axis has seen the same mean square; 0: never"),
        Constant("UNIT_MA", narrowed(table.unit_ma), "mA of a current of 1"),
        Constant("CODES", table.bytes, "uint16, little-endian: x y z of each point"),
    ]


def calibration_constants(calibration: Calibration, board: Board, table: CodeTable, path: str) -> list[Constant]:
    """What was fitted, and by what a run is judged."""
    factory = factory_response(calibration, board, table)
    drift = board.selfcal.gain_drift_limit if calibration.selfcal else WIDE_DRIFT
    return [
        Constant("MODEL", calibration.model.hash, "the effects and their settings"),
        Constant("CALIBRATION", calibration.hash),
        Constant("BOARD", digest(board_constants(board)[:-1]), "bp_board.HASH that this belongs to"),
        Constant("TRAJECTORY", table.id, "bp_trajectory.ID that this belongs to"),
        Constant("PATH", path, "of a streamed row: bytecode, or viper by bp_hot"),
        Constant("EFFECTS", tuple(calibration.model.effects)),
        Constant("HAS_FACTORY_REFERENCE", bool(calibration.selfcal)),
        Constant("FACTORY_GAIN_UT_PER_UNIT", tuple(narrowed(row) for row in factory), "row: axis, column: coil"),
        Constant("FACTORY_OFFSET_LSB", narrowed(factory_offset(calibration)), "of the bridges, beyond the model's"),
        Constant("SLOPE_LSB_PER_UT", narrowed(slope_lsb_per_ut(from_calibration(calibration)))),
        Constant("GAIN_DRIFT_LIMIT", narrowed((drift,))[0], "of a gain over the factory's"),
        Constant("RESIDUAL_LIMIT_UT", narrowed((residual_limit_ut(calibration, board),))[0], "rms of a run"),
    ]


def factory_response(calibration: Calibration, board: Board, table: CodeTable) -> np.ndarray:
    """(3, 3) µT per trajectory unit: the factory's coil run, or nominal parts where there was none.

    The factory may have used another unit of current than this table.
    """
    reference = calibration.selfcal
    if reference is None:
        return np.diag(board.sensor.offset_coil_ut_per_ma * np.asarray(table.unit_ma))
    return np.asarray(reference.gain_ut_per_unit) * (np.asarray(table.unit_ma) / np.asarray(reference.units_ma))


def factory_offset(calibration: Calibration) -> tuple[float, ...]:
    """Electronic offset in LSB that a model fitted to demodulated readings knows nothing of; 0 where it has its own."""
    fitted_already = any(name.startswith(OWN_OFFSET) for name in calibration.parameters)
    if calibration.selfcal is None or fitted_already:
        return 0.0, 0.0, 0.0
    return calibration.selfcal.offset_lsb


def residual_limit_ut(calibration: Calibration, board: Board) -> float:
    """Largest believable residual rms of a coil run, µT.

    `residual_sigma` times the noise of a point; but a calibration cannot claim to be better on the board than it was
    when it was fitted, so three times its own residual is believed too. What of that was not noise is missing
    physics, and grows with the third power of the field where the run goes further than the log went.
    """
    residual, scale = calibration.residual, board.scale_lsb_per_ut
    noise_lsb = residual.noise_lsb or 0.0
    missing_ut = math.sqrt(max(residual.rms_lsb**2 - noise_lsb**2, 0.0)) / scale
    largest_ut = EARTH_UT + max(board.selfcal.radii_ut)
    further = max(largest_ut / (calibration.validity.b_max_ut or largest_ut), 1.0)
    noise_ut = board.selfcal.residual_sigma * point_noise_ut(calibration, board)
    return max(noise_ut, RESIDUALS * max(residual.rms_lsb / scale, missing_ut * further**CURVATURE))


def point_noise_ut(calibration: Calibration, board: Board) -> float:
    """Noise of one point, µT: that of sensor file and converter, or that of the calibration's log if larger.

    White noise n averaged over T has the deviation n / sqrt(2 T); SET and RESET are averaged, and so are cycles.
    """
    seconds = 2.0 * board.selfcal.cycles_per_point * board.adc.samples_per_half / board.adc.sample_hz
    from_sensor = 1e-3 * board.sensor.noise_nt_per_rthz / math.sqrt(2.0 * seconds)
    summed = 2.0 * board.selfcal.cycles_per_point * board.adc.samples_per_half
    from_converter = CONVERTER_NOISE_LSB.get(board.adc.part, 0.0) / board.scale_lsb_per_ut / math.sqrt(summed)
    return max(
        math.hypot(from_sensor, from_converter), (calibration.residual.noise_lsb or 0.0) / board.scale_lsb_per_ut
    )


def digest(constants: list[Constant]) -> str:
    """12 hex digits that change with any constant."""
    text = "\n".join(f"{c.name} = {literal(c.value)}" for c in constants)
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def narrowed(values) -> tuple[float, ...]:
    """As float32 holds them. Raises InputError for what it cannot hold."""
    return tuple(narrow_number(float(v)) for v in values)


def _names(board: Board) -> list[Constant]:
    return [
        Constant("BOARD", board.name),
        Constant("SENSOR", board.sensor.name),
        Constant("WATCHDOG_S", round(board.watchdog_s), "0: none"),
        Constant("SHIELDED", bool(board.shielded), "powers up in a shield: the ambient field is known to be zero"),
    ]


def _members(board: Board) -> list[Constant]:
    """Nothing on a board with one sensor."""
    if not board.members:
        return []
    names = tuple(member.name for member in board.members)
    pins = (board.adc.cs_pin, *(member.cs_pin for member in board.members[1:]))
    return [Constant("SENSORS", names), Constant("CS_PINS", pins, "of a converter each")]


def _flip(board: Board) -> list[Constant]:
    flip = board.flip
    return [
        Constant("SET_PIN", flip.set_pin),
        Constant("RESET_PIN", flip.reset_pin),
        Constant("PULSE_US", round(flip.pulse_us)),
        Constant("SETTLE_US", round(flip.settle_us), "from a pulse to the first sample"),
        Constant("HALF_US", round(0.5e6 / flip.rate_hz), "half a flip cycle"),
        *parts.timed(board),
    ]


def _adc(board: Board) -> list[Constant]:
    adc, scales = board.adc, row_scales(board)
    c = adc.channels
    channels = (c.x, c.y, c.z, c.bridge, c.coil_x, c.coil_y, c.coil_z, c.supply)
    per_lsb = {
        "TEMP_AT_0_C": (scales.zero_c, "bridge temperature for a code of 0"),
        "TEMP_C_PER_LSB": (scales.c_per_lsb, "the bridge's resistance at a constant current is the thermometer"),
        "COIL_MA_PER_LSB": (scales.ma_per_lsb, ""),
        "SUPPLY_V_PER_LSB": (scales.v_per_lsb, ""),
        "SUPPLY_MIN_V": (SUPPLY_FRACTION * board.flip.strap_supply_v, "of the flip pulses"),
        "LSB_PER_V": (_lsb_per_v(board) * adc.pga, "at the bridge"),
    }
    return [
        Constant("ADC_PART", adc.part),
        Constant("ADC_SPI", adc.spi),
        Constant("ADC_BAUD", adc.baud),
        Constant("ADC_CS_PIN", adc.cs_pin),
        Constant("ADC_DRDY_PIN", adc.drdy_pin),
        Constant("ADC_RESET_PIN", adc.reset_pin),
        *parts.adc_registers(board),
        Constant("ADC_CHANNELS", channels, "x y z bridge coil_x coil_y coil_z supply"),
        Constant("SAMPLES_PER_HALF", adc.samples_per_half),
        *(Constant(name, narrowed((value,))[0], comment) for name, (value, comment) in per_lsb.items()),
    ]


def row_scales(board: Board) -> RowScales:
    """From the sums of a cycle to temperature, currents and supply; the bridge's resistance is the thermometer."""
    lsb_per_v = _lsb_per_v(board)
    bridge_v = board.sensor.bridge_v * board.adc.bridge_divider
    c_per_v = 1.0 / (board.sensor.bridge_tempco_per_c * bridge_v)
    return RowScales(
        zero_c=T0_C - c_per_v * bridge_v,
        c_per_lsb=c_per_v / lsb_per_v,
        ma_per_lsb=1000.0 / (board.adc.coil_shunt_ohm * lsb_per_v),
        v_per_lsb=1.0 / (board.adc.supply_divider * lsb_per_v),
        samples=board.adc.samples_per_half,
        conversions=CONVERSIONS,
    )


def _lsb_per_v(board: Board) -> float:
    return float(1 << (board.adc.bits - 1)) / board.adc.vref_v


def _dac(board: Board) -> list[Constant]:
    dac = board.dac
    return [
        *parts.dac_output(board),
        Constant("DAC_SPI", dac.spi),
        Constant("DAC_BAUD", dac.baud),
        Constant("DAC_CS_PIN", dac.cs_pin),
        Constant("DAC_GAIN", dac.gain),
        Constant("DAC_CHANNELS", (dac.channels.coil_x, dac.channels.coil_y, dac.channels.coil_z)),
        Constant("FULL_SCALE_MA", narrowed(board.coils.full_scale_ma), "coil current at the end of the scale"),
    ]


def _selfcal(board: Board) -> list[Constant]:
    run = board.selfcal
    summed = run.cycles_per_point * board.adc.samples_per_half
    most = (1 << 32 - board.adc.bits) - 1
    if summed > most:
        what = "selfcal.cycles_per_point times adc.samples_per_half"
        why = f"sums of {board.adc.bits}-bit codes are kept in 32 bits"
        raise LimitError(must(what, f"at most {most} ({why})", summed))
    return [
        Constant("SETTLE_CYCLES", run.settle_cycles, "dropped after each new current"),
        Constant("CYCLES_PER_POINT", run.cycles_per_point),
        Constant("CURRENT_TOLERANCE", narrowed((run.current_tolerance,))[0]),
        Constant("AMBIENT_STEP_LIMIT_UT", narrowed((run.ambient_step_limit_ut,))[0]),
    ]
