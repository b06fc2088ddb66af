"""The board's self-calibration, computed again on the host in double precision from the board's own points.

Each point gives the field h of the three dies; with u the coil currents in trajectory units, by least squares

    h_i = c_i + sum_j G_ij u_j                                                       (1)
    gain_i = G_ii / G_ii(factory)                                                    (2), thesis 6.7

The bridge's law is curved, so h depends a little on the gains and on the electronic offset at which it is read: both
are found by repeating, the offset from SET and RESET having to give the same field.
What (1) can know and what not is said in firmware/bp_selfcal.py. Arrays are (3, m): x y z by m points.
"""

from dataclasses import dataclass, replace

import numpy as np

from barberpole.board_log import SelfcalRun
from barberpole.calibration_tables import SelfcalReference
from barberpole.effects import STACK, Conditions
from barberpole.errors import InputError, must
from barberpole.fitted import Fitted
from barberpole.model import Model

Array = np.ndarray

UNKNOWNS = 4  # c and three G of each axis
PASSES = 6  # each lessens the error of gains and offsets, at which the bridge's law is read, at least twentyfold


@dataclass(frozen=True)
class SelfcalResult:
    """gain (3,) over the factory's; response_ut (3, 3) µT per unit as the factory calibration reads it; ambient_ut c of
    (1); residual_ut rms by axis; step_ut largest change of c between blocks; offset_lsb (set + reset) / 2; temp_c mean;
    left_ut (3, m) what (1) leaves at each point.
    """

    gain: Array
    response_ut: Array
    ambient_ut: Array
    residual_ut: Array
    step_ut: float
    offset_lsb: Array
    temp_c: float
    left_ut: Array


@dataclass(frozen=True)
class _Reading:
    """How the points are read: field of one coil unit (3,), gains (3,), electronic offset beyond the model's (3,)."""

    coil_ut_per_unit: Array
    gain: Array
    offset_lsb: Array


def recompute(run: SelfcalRun, fitted: Fitted, factory_ut_per_unit: Array, block: int | None = None) -> SelfcalResult:
    """Eqs. (1) and (2). `factory_ut_per_unit` (3, 3) is the factory's response, of which the diagonal is used; `block`
    points make a balanced block, by default what the record says (0: no step is looked for).

    Raises InputError when the points do not determine (1).
    """
    factory = np.diag(np.asarray(factory_ut_per_unit, float))
    slope = slope_lsb_per_ut(fitted)
    gain, offset = np.ones(3), np.zeros(3)
    for _ in range(PASSES):
        field, drift_ut = _fields(run, fitted, _Reading(factory, gain, offset))
        ambient, response, left = _solve(run.unit, field)
        apparent = response * gain[:, None]
        gain, offset = gain * np.diag(response) / factory, offset + slope * gain * drift_ut
        if not np.all(np.isfinite(gain) & (gain > 0)):
            break
    return SelfcalResult(
        gain=gain,
        response_ut=apparent,
        ambient_ut=ambient,
        residual_ut=np.sqrt(np.sum(left**2, axis=1) / (run.unit.shape[1] - UNKNOWNS)),
        step_ut=_step(field, run.header.get("block", 0) if block is None else block),
        offset_lsb=np.mean(0.5 * (run.set_lsb + run.reset_lsb), axis=1),
        temp_c=float(np.mean(run.temp_c)),
        left_ut=left,
    )


def factory_reference(run: SelfcalRun, fitted: Fitted, nominal_ut_per_ma: float) -> SelfcalReference:
    """The calibration's `selfcal` section, from a run made when the calibration's log was (same board, no drift yet).

    `nominal_ut_per_ma` is the sensor's coil constant: a first value for the coil fields, which the run then corrects.
    Raises InputError when the record lacks what a reference needs.
    """
    for key in ("unit_ma", "trajectory"):
        if key not in run.header:
            raise InputError(must("the coil run", f"one whose header gives {key}", "none"))
    unit_ma = np.asarray(run.header["unit_ma"], float)
    slope = slope_lsb_per_ut(fitted)
    coil, offset = nominal_ut_per_ma * unit_ma, np.zeros(3)
    for _ in range(PASSES):
        field, drift_ut = _fields(run, fitted, _Reading(coil, np.ones(3), offset))
        _, response, _ = _solve(run.unit, field)
        coil, offset = np.diag(response), offset + slope * drift_ut
    return SelfcalReference(
        gain_ut_per_unit=(_row(response[0]), _row(response[1]), _row(response[2])),
        units_ma=_row(unit_ma),
        trajectory=str(run.header["trajectory"]),
        offset_lsb=_row(np.mean(0.5 * (run.set_lsb + run.reset_lsb), axis=1)),
        temp_c=float(np.mean(run.temp_c)),
    )


def die_fields(model: Model, p: Array, set_xyz, reset_xyz, at: Conditions) -> tuple[tuple, tuple]:
    """Field that each die feels in µT, its own coil's included: from SET and from RESET readings (sign of SET).

    The two agree where the bridge's electronic offset is the model's. A coil sits on its die, so the effects of the
    space around (misalignment, soft iron) are not undone: they come before `cross_field` in the stack. `cross_field`
    takes the coil's field off, here it is put back. Runs on arrays and on the firmware generator's symbols.
    """
    _, inner = split(model)
    coil = at.coil_ut if "cross_field" in inner.effects else (0.0, 0.0, 0.0)

    def one(xyz, state: float) -> tuple:
        field = inner.undo(xyz, p, replace(at, state=state))
        return tuple(h + c for h, c in zip(field, coil, strict=True))

    return one(set_xyz, 1.0), one(reset_xyz, -1.0)


def slope_lsb_per_ut(fitted: Fitted) -> Array:
    """(3,) LSB/µT of each die at zero field and the reference temperature, from the model."""
    _, inner = split(fitted.model)
    at = fitted.conditions(state=1.0, temp_c=np.full(2, fitted.t0_c), coil_ut=np.zeros((3, 2)))
    slopes = []
    for axis in range(3):
        field = np.zeros((3, 2))
        field[axis] = -1.0, 1.0
        slopes.append(0.5 * np.diff(inner.predict(field, fitted.p, at)[axis])[0])
    return np.array(slopes)


def split(model: Model) -> tuple[Model, Model]:
    """The effects on the field around the sensor, and those of the dies and the electronics."""
    order = [effect.name for effect in STACK]
    first = order.index("cross_field")
    outside = set(order[:first])
    outer = tuple(term for term in model.terms if term.effect.name in outside)
    inner = tuple(term for term in model.terms if term.effect.name not in outside)
    return replace(model, terms=outer), replace(model, terms=inner)


def _fields(run: SelfcalRun, fitted: Fitted, reading: _Reading) -> tuple[Array, Array]:
    """Field of the dies (3, m), and half of what SET and RESET differ by, its mean (3,): both in µT."""
    coil = reading.coil_ut_per_unit[:, None] * run.unit
    at = fitted.conditions(temp_c=run.temp_c, coil_ut=coil, gain=tuple(reading.gain))
    offset = reading.offset_lsb[:, None]
    after_set, after_reset = die_fields(fitted.model, fitted.p, run.set_lsb - offset, offset - run.reset_lsb, at)
    after_set, after_reset = np.stack(after_set), np.stack(after_reset)
    return 0.5 * (after_set + after_reset), np.mean(0.5 * (after_set - after_reset), axis=1)


def _solve(unit: Array, field: Array) -> tuple[Array, Array, Array]:
    """c (3,), G (3, 3) and the residual (3, m) of (1)."""
    m = unit.shape[1]
    rows = np.vstack([np.ones(m), unit]).T
    if m <= UNKNOWNS or np.linalg.matrix_rank(rows) < UNKNOWNS:
        raise InputError(must("the coil run", "points that span all three coils", f"{m} points that do not"))
    solved = np.linalg.lstsq(rows, field.T, rcond=None)[0]
    return solved[0], solved[1:].T, field - (rows @ solved).T


def _step(field: Array, block: int) -> float:
    """Largest change of the mean field between balanced blocks, over the axes, µT."""
    whole = field.shape[1] // block if block else 0
    if whole < 2:
        return 0.0
    means = field[:, : whole * block].reshape(3, whole, block).mean(axis=2)
    return float(np.max(np.ptp(means, axis=1)))


def _row(values: Array) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return x, y, z
