"""Offset of the sensor and residual field of the coils, from turning the sensor over at null field (article 2.4).

    B_off = (B_nor + B_tur) / 2,   B_res = (B_nor - B_tur) / 2

A turn by 180° about one main axis reverses the field on the other two. The log says how each row lay in a column
`turn`: 0 as normal, 1, 2 or 3 after 180° about x, y or z. Each axis takes all turns that reverse it.
"""

from dataclasses import dataclass

import numpy as np

from barberpole.errors import InputError, must
from barberpole.log import Log
from barberpole.methods.answer import Answer, Given, Values, per_axis
from barberpole.methods.guards import require_moving
from barberpole.methods.quality import Quality, rms
from barberpole.methods.readings import demodulated

WHAT = "the turn-over method"
COLUMN = "turn"
LEAST_ROWS = 2  # of a position, for its standard error


@dataclass(frozen=True)
class TurnOver:
    """Offset and residual field of the three axes, (3,) in the unit of the reading, with standard errors (3,)."""

    offset: np.ndarray
    residual: np.ndarray
    stderr: np.ndarray


def turn_over(reading: np.ndarray, turn: np.ndarray) -> TurnOver:
    """Both from readings (3, n) and turns (n,). Raises InputError where an axis was never reversed."""
    wrong = ~np.isin(turn, (0, 1, 2, 3))
    if wrong.any():
        got = f"{turn[np.argmax(wrong)]:g} in row {np.argmax(wrong) + 1}"
        raise InputError(must(f"column {COLUMN}", "0 (normal), 1, 2 or 3 (turned about x, y, z)", got))
    offset, residual, stderr = np.empty(3), np.empty(3), np.empty(3)
    for axis in range(3):
        normal, turned = _positions(reading[axis], turn, axis)
        offset[axis] = 0.5 * (normal.mean() + turned.mean())
        residual[axis] = 0.5 * (normal.mean() - turned.mean())
        white = 0.5 * np.sqrt(normal.var(ddof=1) / normal.size + turned.var(ddof=1) / turned.size)
        stderr[axis] = max(white, _between(reading[axis], turn, axis))
    return TurnOver(offset, residual, stderr)


def _positions(values: np.ndarray, turn: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Readings of one axis with the field as it is, and reversed. A turn about the axis itself leaves it as it is."""
    as_is = (turn == 0) | (turn == axis + 1)
    if min(np.sum(as_is), np.sum(~as_is)) < LEAST_ROWS:
        got = f"{np.sum(as_is)} and {np.sum(~as_is)} on {'xyz'[axis]}"
        raise InputError(must(WHAT, f"given at least {LEAST_ROWS} rows with the axis either way", got))
    return values[as_is], values[~as_is]


def _between(values: np.ndarray, turn: np.ndarray, axis: int) -> float:
    """Standard error from what positions that should agree differ by, for slow noise does not show in one; or 0."""
    means = {k: float(values[turn == k].mean()) for k in (0, 1, 2, 3) if np.any(turn == k)}
    as_is = [m for k, m in means.items() if k in (0, axis + 1)]
    reversed_ = [m for k, m in means.items() if k not in (0, axis + 1)]
    free = len(means) - 2
    if free < 1:
        return 0.0
    left = sum(len(g) * float(np.var(g)) for g in (as_is, reversed_))
    return float(0.5 * np.sqrt(left / free * (1.0 / len(as_is) + 1.0 / len(reversed_))))


def turn_over_log(log: Log, given: Given) -> Answer:
    """The method on a log with a column `turn`. Raises InputError without one."""
    if not log.has(COLUMN):
        wanted = f"given a column {COLUMN}: 0 as normal, 1, 2, 3 after 180° about x, y, z"
        raise InputError(must(WHAT, wanted, "a log without it", log.path))
    reading = demodulated(log, WHAT).y
    require_moving(reading, WHAT, log.path, every=True)
    found = turn_over(reading, log[COLUMN])
    return Answer(_values(found), quality=_quality(reading, log[COLUMN], found))


def _quality(reading: np.ndarray, turn: np.ndarray, found: TurnOver) -> Quality:
    """What offset and residual field leave of the readings; held out: every other row of a position by the others."""
    place = np.empty(turn.size, int)
    for k in np.unique(turn):
        place[turn == k] = np.arange(np.sum(turn == k))
    left = np.empty(reading.shape)
    for half in (0, 1):
        out = place % 2 == half
        kept = reading[:, ~out], turn[~out]
        left[:, out] = _left(reading[:, out], turn[out], _offsets(*kept))
    return Quality(rms(_left(reading, turn, (found.offset, found.residual))), rms(left))


def _offsets(reading: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Offset and residual field (3,) without their errors; NaN where a part of the rows lacks a position."""
    sides = [(turn == 0) | (turn == axis + 1) for axis in range(3)]
    if any(np.all(side) or not np.any(side) for side in sides):
        return np.full(3, np.nan), np.full(3, np.nan)
    normal, turned = (
        [v[at].mean() for v, at in zip(reading, ways, strict=True)] for ways in (sides, [~s for s in sides])
    )
    return 0.5 * (np.array(normal) + turned), 0.5 * (np.array(normal) - turned)


def _left(reading: np.ndarray, turn: np.ndarray, by: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """(3, n): readings less the offset and the residual field as it lies."""
    sign = np.array([np.where((turn == 0) | (turn == axis + 1), 1.0, -1.0) for axis in range(3)])
    return reading - by[0][:, None] - sign * by[1][:, None]


def _values(found: TurnOver) -> Values:
    offset = per_axis("offset", found.offset, found.stderr, "LSB")
    return offset | per_axis("residual_field", found.residual, found.stderr, "LSB")
