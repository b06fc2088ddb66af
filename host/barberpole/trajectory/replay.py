"""A recorded field driven again: the motion of a past log, seen by a sensor that lies still."""

import numpy as np

from barberpole.errors import InputError, must
from barberpole.trajectory.shapes import Trajectory

COLUMNS = ("bx_ut", "by_ut", "bz_ut")


def replay(log, points: int) -> Trajectory:
    """The applied field of a log (bx_ut, by_ut, bz_ut), (points, 3) in µT, at evenly spaced rows.

    Raises InputError when the log holds no field vector, or fewer rows than points.
    """
    missing = [name for name in COLUMNS if not log.has(name)]
    if missing:
        raise InputError(must("a log to replay", "one with bx_ut, by_ut, bz_ut", f"no {', '.join(missing)}", log.path))
    if not 1 <= points <= log.n:
        raise InputError(must("points", f"between 1 and the {log.n} rows of the log", points, log.path))
    rows = np.round(np.linspace(0, log.n - 1, points)).astype(int)
    return Trajectory("replay", np.stack([np.asarray(log[name])[rows] for name in COLUMNS], axis=1))
