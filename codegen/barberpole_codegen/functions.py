"""The three functions of bp_calibration, traced from the calibration's own model.

undo        readings of SET and RESET -> field in the frame of the calibration
undo_coil   the same readings with coils on -> field that each die feels, its own coil's included
in_frame    field of the dies -> field in the frame of the calibration (misalignment and the like)

and the row of bp_hot: sums of a cycle -> temperature, coil currents, supply and field.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from barberpole.fitted import Fitted
from barberpole.selfcal import die_fields, split

from barberpole_codegen.trace import Program, trace

GAINS = ("gx", "gy", "gz")
READINGS = ("xs", "ys", "zs", "xr", "yr", "zr", "t", *GAINS)
COILS = ("cx", "cy", "cz")
SHIFTS = ("hx", "hy", "hz")
SUMS = ("xs", "ys", "zs", "xr", "yr", "zr", "bridge", "coil_x", "coil_y", "coil_z", "supply")


def trace_undo(fitted: Fitted) -> Program:
    """`undo` of READINGS."""

    def undo(*given: Any) -> Sequence[Any]:
        set_xyz, reset_xyz, temp_c, gain = _unpack(given)
        return fitted.undo_pair(set_xyz, reset_xyz, fitted.conditions(temp_c=temp_c, gain=gain))

    return trace(undo, READINGS)


def trace_undo_coil(fitted: Fitted) -> Program:
    """`undo_coil` of READINGS and COILS, the latter in µT."""

    def undo_coil(*given: Any) -> Sequence[Any]:
        set_xyz, reset_xyz, temp_c, gain = _unpack(given[:10])
        at = fitted.conditions(temp_c=temp_c, gain=gain, coil_ut=given[10:])
        after_set, after_reset = die_fields(fitted.model, fitted.p, set_xyz, reset_xyz, at)
        return *after_set, *after_reset

    return trace(undo_coil, READINGS + COILS)


def trace_in_frame(fitted: Fitted) -> Program:
    """`in_frame` of three fields in µT."""
    outer, _ = split(fitted.model)
    return trace(lambda *xyz: outer.undo(xyz, fitted.p, fitted.conditions(state=0.0)), ("x", "y", "z"))


@dataclass(frozen=True)
class RowScales:
    """From sums to figures: temperature (°C at code 0 and per LSB), mA and V per LSB, samples summed."""

    zero_c: float
    c_per_lsb: float
    ma_per_lsb: float
    v_per_lsb: float
    samples: int
    conversions: int


def trace_row(fitted: Fitted, scales: RowScales, shielded: bool) -> Program:
    """The row of SUMS (offsets taken off, both magnetisations with the sign of SET) and GAINS; where the board is
    shielded, SHIFTS (µT) are taken from the field."""

    def row(*given: Any) -> Sequence[Any]:
        sums, gain, shift = given[:11], given[11:14], given[14:]
        means = [v * (1.0 / scales.samples) for v in sums[:6]]
        bridge, *coils, supply = (v * (1.0 / scales.conversions) for v in sums[6:])
        temp_c = scales.zero_c + scales.c_per_lsb * bridge
        field = fitted.undo_pair(means[:3], means[3:], fitted.conditions(temp_c=temp_c, gain=gain))
        field = [v - h for v, h in zip(field, shift, strict=True)] if shift else field
        return temp_c, *(scales.ma_per_lsb * v for v in coils), scales.v_per_lsb * supply, *field

    return trace(row, (*SUMS, *GAINS, *(SHIFTS if shielded else ())))


def _unpack(given: Sequence[Any]) -> tuple:
    return given[:3], given[3:6], given[6], given[7:10]
