"""A sensor's log and a driver's record as one log with a vector reference (thesis 6.1.2.1).

    B = k i      applied field: coil constants times the currents read back                                      (1)

Read back, the currents hold whatever the coils' resistance does as they warm. Rows that saw a step of the field, or no
point at all, are left out.
"""

from dataclasses import dataclass, replace

import numpy as np

from barberpole.columns import FIELD, READINGS
from barberpole.errors import InputError, must
from barberpole.imcs.clocks import Clocks, agree
from barberpole.imcs.driven import Driven
from barberpole.log import Log

FEWEST_ROWS = 12
CLOCK_S = 1e-3  # to which the clocks are known


@dataclass(frozen=True)
class Joined:
    """The sensor's rows with bx_ut, by_ut, bz_ut; how the clocks lie; rows left out."""

    log: Log
    clocks: Clocks
    dropped: int


def join(sensor: Log, driven: Driven, ut_per_ma: np.ndarray | None = None) -> Joined:
    """The sensor's rows that saw one field throughout, with that field by equation 1.

    ut_per_ma: (3,), or (3, 3) where a reference magnetometer found the angles between the coils too; those of the
    record unless given. Raises InputError where the log has no times or a field of its own, or does not follow.
    """
    if not sensor.has("t_s"):
        raise InputError(must("the sensor's log", "one with times t_s", "none", sensor.path))
    if sensor.has(FIELD[0]):
        raise InputError(must("the sensor's log", "one that does not know its field yet", FIELD[0], sensor.path))
    t_s = sensor["t_s"]
    clocks = agree(np.stack([sensor[name] for name in READINGS]), t_s, driven, sensor.path)
    there, margin = clocks.driver_s(t_s), CLOCK_S + 0.5 * float(np.median(np.diff(t_s)))
    hold = np.clip(np.searchsorted(driven.from_s, there, side="right") - 1, 0, None)
    kept = (there - margin >= driven.from_s[hold]) & (there + margin <= driven.to_s[hold])
    if kept.sum() < FEWEST_ROWS:
        got = f"{int(kept.sum())} of {t_s.size}"
        raise InputError(must("the sensor's log", f"one with {FEWEST_ROWS} rows within points", got, sensor.path))
    constants = np.asarray(driven.ut_per_ma if ut_per_ma is None else ut_per_ma, float)
    field = (np.diag(constants) if constants.ndim == 1 else constants) @ driven.current_ma[:, hold[kept]]
    rows = sensor.take(kept)
    notes = (*sensor.notes, *driven.notes, _said(driven, clocks))
    columns = {**rows.columns, **dict(zip(FIELD, field, strict=True))}
    return Joined(replace(rows, columns=columns, notes=notes), clocks, int(np.sum(~kept)))


def _said(driven: Driven, clocks: Clocks) -> str:
    ahead = f"its clock is {clocks.shift_s:.3f} s ahead"
    return f"field from {driven.path.name}: {ahead}" + (
        f" and {1e6 * clocks.drift:.0f} ppm faster" if clocks.drift else ""
    )
