"""The conditions under which generated arithmetic is tried, and the readings the model gives there.

Both directions use the calibration's own model: forward for the readings, the traced undo for the way back. Where the
model itself cannot be inverted (a bridge turned past 45 degrees) the range is cut, and the cut range is what the board
promises; it must still hold the coil run in the largest field of the Earth.
"""

from dataclasses import dataclass

import numpy as np
from barberpole.board import Board
from barberpole.effects import Conditions
from barberpole.errors import LimitError, must
from barberpole.fitted import Fitted
from barberpole.selfcal import split

from barberpole_codegen.narrow import Precision, precision, require
from barberpole_codegen.trace import Program

SAMPLES = 4000
EARTH_UT = 67.0  # the largest field at the Earth's surface
TEMP_C = (-40.0, 85.0)  # industrial range, where the calibration does not say
FRACTIONS = (1.0, 0.8, 0.6, 0.5, 0.4, 0.3, 0.25, 0.2, 0.15, 0.1)  # of the sensor's range
INVERTS = 1e-6  # of full scale: better than this, the double inverse counts as exact


@dataclass(frozen=True)
class Tried:
    """n conditions: field_ut (3, n), gain (3, n), temp_c (n,), coil_ut (3, n)."""

    field_ut: np.ndarray
    gain: np.ndarray
    temp_c: np.ndarray
    coil_ut: np.ndarray


def conditions(range_ut: float, board: Board, temps_c: tuple[float, float], coil_ut: float) -> Tried:
    """Corners and an even spread of the range; the own field of a die, coil included, stays within it."""
    rng = np.random.default_rng(20130601)
    n = SAMPLES
    corner = np.sign(rng.uniform(-1, 1, (3, n)))
    spread = np.where(np.arange(n) % 10 == 0, corner, rng.uniform(-1, 1, (3, n)))
    coil = coil_ut * rng.uniform(-1, 1, (3, n))
    drift = board.selfcal.gain_drift_limit
    return Tried(
        field_ut=spread * max(range_ut - coil_ut, 0.0),
        gain=1.0 + drift * rng.uniform(-1, 1, (3, n)),
        temp_c=rng.uniform(*temps_c, n),
        coil_ut=coil,
    )


def compensation(program: Program, fitted: Fitted, board: Board, temps_c: tuple[float, float]) -> Precision:
    """Precision of `undo` over the largest range in which the model inverts. Raises LimitError."""

    def attempt(range_ut: float) -> Precision:
        tried = conditions(range_ut, board, temps_c, 0.0)
        return precision(program, readings(fitted, fitted.model, tried), tried.field_ut, range_ut)

    return _widest(attempt, board, "the compensation")


def coil_run(program: Program, fitted: Fitted, board: Board, temps_c: tuple[float, float]) -> Precision:
    """Precision of `undo_coil`: the own field of each die, with coils on."""
    largest = max(board.selfcal.radii_ut)
    _, inner = split(fitted.model)

    def attempt(range_ut: float) -> Precision:
        tried = conditions(range_ut, board, temps_c, largest)
        given = readings(fitted, inner, tried)
        given |= dict(zip(("cx", "cy", "cz"), tried.coil_ut, strict=True))
        own = tried.field_ut + tried.coil_ut
        return precision(program, given, np.concatenate([own, own]), range_ut)

    return _widest(attempt, board, "the field of the dies")


def _widest(attempt, board: Board, what: str) -> Precision:
    needed = max(board.selfcal.radii_ut) + EARTH_UT
    for fraction in FRACTIONS:
        range_ut = fraction * board.sensor.range_ut
        found = attempt(range_ut) if range_ut >= needed else None
        if found is not None and found.inverse_ut <= INVERTS * range_ut:
            require(found, what)
            return found
    reason = f"over ±{needed:.0f} µT (the coil run and the Earth's field)"
    raise LimitError(must("the calibration", f"a model that can be undone {reason}", "one that cannot"))


def readings(fitted: Fitted, model, tried: Tried) -> dict[str, np.ndarray]:
    """Inputs of the generated functions: SET and RESET readings with the sign of SET, temperature, gains."""
    given: dict[str, np.ndarray] = {"t": tried.temp_c}
    given |= dict(zip(("gx", "gy", "gz"), tried.gain, strict=True))
    own_coil = "cross_field" in model.effects
    for state, suffix in ((1.0, "s"), (-1.0, "r")):
        coil = tried.coil_ut if own_coil else np.zeros_like(tried.coil_ut)
        field = tried.field_ut if own_coil else tried.field_ut + tried.coil_ut
        at: Conditions = fitted.conditions(state=state, temp_c=tried.temp_c, coil_ut=coil, gain=tuple(tried.gain))
        xyz = field
        for term in model.terms:
            xyz = term.effect.forward(xyz, fitted.p[term.at], at)
        given |= dict(zip((f"x{suffix}", f"y{suffix}", f"z{suffix}"), map(np.asarray, xyz), strict=True))
    return given
