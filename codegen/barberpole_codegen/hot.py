"""The row of one flip cycle, from the sums of its samples to physical figures, in fixed point.

The same `undo` that bp_calibration does in floats, with the temperature, the currents and the supply beside it. The
range is the largest in which the proof of fixed.py holds; the board leaves every row outside it to the float version.
"""

import struct
from dataclasses import dataclass

import numpy as np
from barberpole.board import Board
from barberpole.errors import LimitError
from barberpole.fitted import Fitted

from barberpole_codegen import coverage, settings
from barberpole_codegen.emit import Constant, Function, module
from barberpole_codegen.fixed import BITS, Fixed, FixedProgram, Interval, exponent
from barberpole_codegen.fixed_trace import fix
from barberpole_codegen.functions import GAINS, SHIFTS, SUMS, trace_row
from barberpole_codegen.narrow import narrow

READINGS = SUMS[:6]
OFFSET_ROOM = 8  # the offset that bp_fast takes off a reading is at most this part of the converter's codes
ROOM = 1.02  # the box of a reading over what the model gives in the range
SHIFT_UT = 20.0  # largest change of the bias that a shielded run may find
SMALLEST_UT = coverage.EARTH_UT  # a narrower range is of no use


@dataclass(frozen=True)
class Hot:
    """A row in fixed point: proven for fields within ±range_ut, off by at most error_ut there (worst case)."""

    program: FixedProgram
    slow: tuple[Interval, ...]
    range_ut: float
    error_ut: float

    def count(self) -> dict[str, int]:
        """Instructions of a row by kind."""
        products = sum(i.operation == 0 for i in self.program.instructions)
        return {"products": products, "sums": len(self.program.instructions) - products}


def hot_row(fitted: Fitted, board: Board, temps_c: tuple[float, float]) -> Hot | None:
    """The row for this calibration, None where no range that holds the Earth's field can be proved."""
    traced = narrow(trace_row(fitted, settings.row_scales(board), board.shielded))
    slow = _slow(board)
    for fraction in coverage.FRACTIONS:
        range_ut = fraction * board.sensor.range_ut
        if range_ut < SMALLEST_UT:
            return None
        try:
            program = fix(traced, _inputs(fitted, board, temps_c, range_ut), slow)
        except LimitError:
            continue
        return Hot(program, tuple(slow.values()), range_ut, max(v.error for v in program.outputs[-3:]))
    return None


def _inputs(fitted: Fitted, board: Board, temps_c: tuple[float, float], range_ut: float) -> dict[str, Fixed]:
    """The box of each input in units of its sum: what the model gives in the range, temperatures and gains tried."""
    tried = coverage.conditions(range_ut, board, temps_c, 0.0)
    given = coverage.readings(fitted, fitted.model, tried)
    samples, full_scale = board.adc.samples_per_half, 1 << board.adc.bits  # codes with or without a sign
    placed = {
        name: _input(_box(samples * given[name], ROOM), samples * (full_scale + _most_offset(board)))
        for name in READINGS
    }
    scales = settings.row_scales(board)
    bridge = _box((scales.conversions / scales.c_per_lsb) * (np.asarray(temps_c) - scales.zero_c), 1.0)
    most = float(scales.conversions * full_scale)
    placed["bridge"] = _input(bridge, most)
    return placed | {name: _input(Interval(-most, most), most) for name in SUMS[7:]}


def _most_offset(board: Board) -> int:
    return (1 << board.adc.bits) // OFFSET_ROOM


def _box(values: np.ndarray, room: float) -> Interval:
    middle, half = 0.5 * (values.max() + values.min()), 0.5 * (values.max() - values.min())
    return Interval(float(middle - room * half), float(middle + room * half))


def _input(box: Interval, most: float) -> Fixed:
    """As large as 30 bits hold in the box, and 32 bits with anything that the converter can give (`most`).

    The error is the rounding of the offset that is taken from a reading.
    """
    k = max(exponent(box.largest + 1.0), exponent(most) - 1)
    return Fixed(-1, k, box, 0.5 * 2.0 ** (k - BITS))


def _slow(board: Board) -> dict[str, Interval]:
    drift = board.selfcal.gain_drift_limit
    boxes = {name: Interval(1.0 - drift, 1.0 + drift) for name in GAINS}
    return boxes | ({name: Interval(-SHIFT_UT, SHIFT_UT) for name in SHIFTS} if board.shielded else {})


def hot_text(hot: Hot, board: Board, calibration: str, version: str) -> str:
    """bp_hot.py, of the calibration with this hash."""
    count, program = hot.count(), hot.program
    notes = [
        f"{len(program.instructions)} instructions for a row: {count['products']} products, {count['sums']} sums.",
        f"Proven within +-{hot.range_ut:g} uT: nothing overflows, and the field is off by at most",
        f"{1e3 * hot.error_ut:.2g} nT against exact arithmetic (every rounding at its largest, all of one sign).",
    ]
    comment = ("What changes once per power-up, in the order of SLOW.",)
    slow = Function("slow", program.slow_float, comment)
    constants = [Constant("CALIBRATION", calibration, "that this belongs to"), *_constants(hot, board)]
    title = "bp_hot.py: a row in fixed point, run by bp_fixed."
    return module(title, f"calibration {calibration}", version, notes, constants, [slow])


def _constants(hot: Hot, board: Board) -> list[Constant]:
    program = hot.program
    placed = [program.inputs[name] for name in SUMS]
    limits = [_limits(v) for v in placed]
    registers = [program.constants.get(at, 0) for at in range(program.registers)]
    code = b"".join(
        struct.pack("<4H", i.operation | i.right_a << 2 | i.right_b << 7 | i.left << 12, i.into, i.a, i.b)
        for i in program.instructions
    )
    return [
        Constant("RANGE_UT", float(hot.range_ut)),
        Constant("ERROR_UT", settings.narrowed((hot.error_ut,))[0], "largest, in that range"),
        Constant("COUNT", len(program.instructions)),
        Constant("CODE", code, "uint16: operation and shifts, into, a, b"),
        Constant("REGISTERS", struct.pack(f"<{len(registers)}i", *registers), "int32: constants, zero elsewhere"),
        Constant("INPUTS", _halfwords([v.register for v in placed]), "uint16: register of each sum"),
        Constant("SHIFTS", _halfwords([BITS - v.k for v in placed]), "uint16: to the left, from sum to register"),
        Constant("MOST_OFFSET_LSB", _most_offset(board), "that is taken off a reading"),
        Constant("LOW", struct.pack(f"<{len(limits)}i", *(low for low, _ in limits)), "int32: of an input register"),
        Constant("HIGH", struct.pack(f"<{len(limits)}i", *(high for _, high in limits))),
        Constant("SLOW", tuple(v.register for v in program.slow), "registers of what slow() gives"),
        Constant("SLOW_PER_ONE", tuple(2.0 ** (BITS - v.k) for v in program.slow), "register over value"),
        Constant("SHIFTED", len(hot.slow) > len(GAINS), "whether a shift in uT follows the gains"),
        Constant("SLOW_BOX", tuple(settings.narrowed((v.low, v.high)) for v in hot.slow), "of what goes into slow()"),
        Constant("OUTPUTS", _halfwords([v.register for v in program.outputs]), "uint16: t, coils, supply, field"),
        Constant("EXPONENTS", _halfwords([126 + v.k for v in program.outputs]), "uint16: of float32, bit 29 set"),
    ]


def _limits(placed: Fixed) -> tuple[int, int]:
    scale = 2.0 ** (BITS - placed.k)
    return int(np.ceil(placed.interval.low * scale)), int(np.floor(placed.interval.high * scale))


def _halfwords(values: list[int]) -> bytes:
    return struct.pack(f"<{len(values)}H", *values)
