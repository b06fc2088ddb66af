"""The field that a sensor saw while it was turned, for playing it again around a sensor that lies still (6.1.3.1).

As "the dataset of the outdoor trajectory are processed [...] to provide the same trajectory" (thesis): the readings
through the two-step ellipsoid are the field in the sensor's frame, but for a rotation that nobody needs.
"""

from dataclasses import replace

from barberpole.columns import FIELD
from barberpole.fit.fit import NOMINAL_MAGNITUDE_UT
from barberpole.log import Log
from barberpole.methods.ellipsoid import efficient
from barberpole.methods.readings import one_magnitude, scalar
from barberpole.methods.scalar import require_seen

WHAT = "a trajectory to replay"


def field_of(log: Log, otherwise_ut: float = NOMINAL_MAGNITUDE_UT) -> Log:
    """The log with bx_ut.. by the ellipsoid (4.20); as it is where it knows them. Raises InputError as `ellipsoid`."""
    if log.has(*FIELD):
        return log
    seen = scalar(log, WHAT)
    known = one_magnitude(seen, otherwise_ut, WHAT, log.path)
    require_seen(seen, known, log.path)
    field = efficient(seen.y, known).field(seen.y)
    return replace(log, columns={**log.columns, **dict(zip(FIELD, field, strict=True))})
