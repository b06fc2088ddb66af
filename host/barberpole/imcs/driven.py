"""The record of a coil driver: what was held, when, and with which currents."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from barberpole.board_log import read_board_log
from barberpole.columns import CURRENT
from barberpole.driver_board import ROLE
from barberpole.errors import InputError, must
from barberpole.files import read_bytes

FEWEST_POINTS = 12
TIMES = ("t_s", "from_s", "to_s")

Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class Driven:
    """n points held one after the other; times in s by the driver's clock.

    from_s, to_s    (n,) while the field stood still
    current_ma      (3, n) read back
    ut_per_ma       (3,) coil constants that the driver says
    """

    from_s: np.ndarray
    to_s: np.ndarray
    current_ma: np.ndarray
    ut_per_ma: np.ndarray
    path: Path
    notes: tuple[str, ...] = ()

    @property
    def pitch_s(self) -> float:
        """From one point to the next, s."""
        return float(np.median(np.diff(self.from_s)))


def read_driven(path: str | Path) -> Driven:
    """The record (.bpr) of a coil driver. Raises InputError where it is a sensor board's, or holds too little."""
    path = Path(path)
    found = read_board_log(read_bytes(path, "the driver's record"), path)
    if found.meta.get("role") != ROLE:
        raise InputError(must("the driver's record", "one of a coil driver", "one of a sensor board", path))
    columns = _checked(found.columns, found.meta, path)
    count = len(columns["t_s"])
    if count < FEWEST_POINTS:
        raise InputError(must("the driver's record", f"one of {FEWEST_POINTS} points or more", count, path))
    events = tuple(f"{e.get('name')}: {e.get('text')} {e.get('values', '')}" for e in found.meta["events"])
    return Driven(
        columns["from_s"],
        columns["to_s"],
        np.stack([columns[name] for name in CURRENT]),
        np.asarray(found.meta["ut_per_ma"], float),
        path,
        (*found.notes, *events),
    )


def _checked(columns: Columns, meta: dict[str, Any], path: Path) -> Columns:
    """The columns, where all that a driver says is there, in numbers, one point after the other."""
    lacking = [name for name in (*TIMES, *CURRENT) if name not in columns]
    lacking += [] if "ut_per_ma" in meta else ["ut_per_ma"]
    if lacking:
        raise InputError(must("the driver's record", f"one with {', '.join(lacking)}", "none", path))
    if not all(np.all(np.isfinite(columns[name])) for name in (*TIMES, *CURRENT)):
        raise InputError(must("the driver's record", "one of numbers", "a point without", path))
    after = np.diff(columns["from_s"]) > 0
    if not (np.all(after) and np.all(columns["to_s"] > columns["from_s"]) and np.all(np.diff(columns["to_s"]) > 0)):
        raise InputError(must("the driver's record", "one of points held one after the other", "another order", path))
    return columns
