"""What a fit sees of a log: readings with the sign of SET, the conditions of each, and the reference field."""

from dataclasses import dataclass, replace

import numpy as np

from barberpole.columns import CURRENT, FIELD, READINGS, RESET, SET
from barberpole.effects.effect import Conditions
from barberpole.errors import InputError, must
from barberpole.log import Log, resets_are_raw
from barberpole.polarity import states_are_raw
from barberpole.sensor import Sensor


@dataclass(frozen=True, eq=False)
class Observations:
    """n readings; where a log carries both magnetisations they alternate, SET first, so n is twice its rows.

    y           (3, n) LSB, RESET readings with the sign of SET
    at          Conditions, arrays of length n
    b_ut        (3, n) µT, the applied field where known; b_mag (n,) µT, its magnitude where only that is known
    row         (n,) row of the log that each reading came from
    reference   "vector", "magnitude" or "constant": what is known of the field
    raw_polarity    RESET readings came raw and were turned here, so the bridge's own offset alternates in y
    notes       what was decided on the way, in sentences
    sensor_known    a sensor file gave the easy axes
    """

    y: np.ndarray
    at: Conditions
    b_ut: np.ndarray | None
    b_mag: np.ndarray | None
    row: np.ndarray
    reference: str
    raw_polarity: bool
    notes: tuple[str, ...] = ()
    sensor_known: bool = False


def observations(log: Log, sensor: Sensor | None = None, raw: bool | None = None) -> Observations:
    """The log as a fit sees it. `sensor` gives the easy axes; without it those of Conditions hold (thesis 5.3.2) unless
    the log shows others (`fit.easy_axes`).

    raw: whether RESET readings have the reversed sign, where that is known; else the log says or its data decide.
    """
    if log.has(*SET, *RESET):
        y, state, raw = _pairs(log, raw)
        repeat = 2
    else:
        y, state, raw = _singles(log, raw)
        repeat = 1
    at = _conditions(log, state, raw, repeat, sensor)
    b_ut, b_mag = _repeated(log.stack(FIELD), repeat), _repeated(log.get("b_ut"), repeat)
    notes = ("RESET readings come with reversed sign: turned",) if raw else ()
    row = np.repeat(np.arange(log.n), repeat)
    return Observations(y, at, b_ut, b_mag, row, _reference(b_ut, b_mag), raw, notes, sensor is not None)


def as_told(seen: Observations, kind: str | None) -> Observations:
    """The observations with as much of the field as a model file's `reference.kind` wants to be known of it.

    Raises InputError where the log knows less.
    """
    if kind is None or kind == seen.reference:
        return seen
    if kind == "constant":
        return replace(seen, b_ut=None, b_mag=None, reference=kind)
    if kind == "magnitude" and seen.b_ut is not None:
        return replace(seen, b_ut=None, b_mag=np.linalg.norm(seen.b_ut, axis=0), reference=kind)
    columns = "bx_ut, by_ut, bz_ut" if kind == "vector" else "b_ut"
    raise InputError(must("the log", f"one with {columns}, for the reference of the model file ({kind})", "none"))


def _pairs(log: Log, known: bool | None) -> tuple[np.ndarray, np.ndarray, bool]:
    """SET and RESET readings in turns: y (3, 2 n), state (2 n,), whether RESET was raw."""
    raw = resets_are_raw(log) if known is None else known
    y = np.empty((3, 2 * log.n))
    y[:, 0::2] = [log[name] for name in SET]
    y[:, 1::2] = [log[name] for name in RESET]
    state = np.tile([1.0, -1.0], log.n)
    return np.where(raw & (state < 0), -y, y), state, raw


def _singles(log: Log, known: bool | None) -> tuple[np.ndarray, np.ndarray, bool]:
    """One reading a row, in the state that its column gives; 0 without one."""
    y = np.stack([log[name] for name in READINGS])
    state = log["state"] if log.has("state") else np.zeros(log.n)
    flipped = state != 0
    if known is not None:
        return np.where(known & (state < 0), -y, y), state, known
    if not (np.any(state > 0) and np.any(state < 0)):
        return y, state, False
    field = log.stack(FIELD)
    raw = states_are_raw(y[:, flipped], state[flipped], None if field is None else field[:, flipped])
    return np.where(raw & (state < 0), -y, y), state, raw


def _conditions(log: Log, state: np.ndarray, raw: bool, repeat: int, sensor: Sensor | None) -> Conditions:
    return Conditions(
        state=state,
        t_s=_repeated(log.get("t_s"), repeat),
        temp_c=_repeated(log.get("temp_c"), repeat),
        i_ma=_repeated(log.stack(CURRENT), repeat),
        load_a=_repeated(log.get("load_a"), repeat),
        supply_v=_repeated(log.get("supply_v"), repeat),
        easy_axis=sensor.easy_axis_index if sensor else Conditions.easy_axis,
        raw_polarity=raw,
    )


def _repeated(values: np.ndarray | None, repeat: int) -> np.ndarray | None:
    return None if values is None else np.repeat(values, repeat, axis=-1)


def _reference(b_ut: np.ndarray | None, b_mag: np.ndarray | None) -> str:
    if b_ut is not None:
        return "vector"
    return "constant" if b_mag is None else "magnitude"
