"""The three functions of bp_calibration, traced from the calibration's own model.

undo        readings of SET and RESET -> field in the frame of the calibration
undo_coil   the same readings with coils on -> field that each die feels, its own coil's included
in_frame    field of the dies -> field in the frame of the calibration (misalignment and the like)
"""

from collections.abc import Sequence
from typing import Any

from barberpole.fitted import Fitted
from barberpole.selfcal import die_fields, split

from barberpole_codegen.trace import Program, trace

READINGS = ("xs", "ys", "zs", "xr", "yr", "zr", "t", "gx", "gy", "gz")
COILS = ("cx", "cy", "cz")


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


def _unpack(given: Sequence[Any]) -> tuple:
    return given[:3], given[3:6], given[6], given[7:10]
