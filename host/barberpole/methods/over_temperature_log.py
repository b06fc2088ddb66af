"""Calibrations over temperature from logs: one log a temperature, or one log that passes through several."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from barberpole.errors import InputError, must
from barberpole.fit.ellipsoid import Ellipsoid
from barberpole.fit.fit import NOMINAL_MAGNITUDE_UT
from barberpole.log import Log
from barberpole.methods.answer import Answer, Given
from barberpole.methods.ellipsoid import efficient
from barberpole.methods.guards import LEAST_ROWS, require_rows
from barberpole.methods.linear import linear_model
from barberpole.methods.over_temperature import DEGREE_A, OverTemperature, over_temperature, values_of
from barberpole.methods.quality import Quality, of_the_norm
from barberpole.methods.readings import demodulated, one_magnitude, scalar, vector
from barberpole.methods.scalar import require_seen

WHAT = "a calibration over temperature"
PIECES = 8  # of one log, by temperature
STEADY_K = 2.0  # range of temperature that still counts as one


def from_logs(logs: Sequence[Log], given: Given) -> OverTemperature:
    """Thesis 6.1.3.2 on many logs, one temperature each.

    Raises InputError where a log has no temp_c, does not hold its temperature, or cannot be calibrated.
    """
    temps, shapes = [], []
    for log in logs:
        temp = _temperature(log)
        if np.ptp(temp) > STEADY_K:
            got = f"{temp.min():.1f} to {temp.max():.1f} °C"
            raise InputError(must("each log", f"at one temperature within {STEADY_K:g} K", got, log.path))
        temps.append(float(np.mean(temp)))
        shapes.append(_shape(log, given))
    return over_temperature(np.array(temps), shapes)


def temperature(log: Log, given: Given) -> Answer:
    """The same on one log that passes through several temperatures, cut into pieces of as many rows by temperature."""
    temp = _temperature(log)
    if np.ptp(temp) < STEADY_K:
        got = f"{temp.min():.1f} to {temp.max():.1f} °C"
        raise InputError(must(WHAT, "given a range of temperatures (or many logs: calibrate-over-temperature)", got))
    require_rows(log.n, PIECES * LEAST_ROWS, WHAT, log.path)
    order = np.argsort(temp, kind="stable")
    edges = np.linspace(0, log.n, PIECES + 1).astype(int)
    parts = [log.take(np.sort(order[a:b])) for a, b in pairwise(edges)]
    temps, shapes = np.array([np.mean(part["temp_c"]) for part in parts]), [_shape(p, given) for p in parts]
    found = over_temperature(temps, shapes)
    note = f"{PIECES} pieces by temperature; quadratic in B, cubic in A (degree {DEGREE_A})"
    return Answer(values_of(found), notes=(note,), quality=_quality(found, parts, shapes, given))


def _quality(found: OverTemperature, parts: list[Log], shapes: list[Ellipsoid], given: Given) -> Quality:
    """|H| against its magnitude; held out: each piece by polynomials through the calibrations of the others."""
    left, heldout = [], []
    for k, part in enumerate(parts):
        others = [s for i, s in enumerate(shapes) if i != k]
        without = over_temperature(np.delete(found.temp_c, k), others)
        left.append(_off(found, part, given))
        heldout.append(_off(without, part, given))
    upper = found.at(found.t0_c)[0]
    known = float(np.mean([_magnitude(part, given).mean() for part in parts]))
    return of_the_norm(np.concatenate(left), np.concatenate(heldout), upper, known)


def _off(found: OverTemperature, part: Log, given: Given) -> np.ndarray:
    """|H| - |B| (n,) in µT by eq. 4.5 at each row's temperature."""
    a, b = found.each(part["temp_c"])
    y = demodulated(part, WHAT).y
    return np.linalg.norm(np.einsum("ijn,jn->in", a, y) + b, axis=0) - _magnitude(part, given)


def _magnitude(part: Log, given: Given) -> np.ndarray:
    seen = demodulated(part, WHAT)
    if seen.b_ut is not None:
        return np.linalg.norm(seen.b_ut, axis=0)
    otherwise_ut = float(given.reference.get("magnitude_ut", NOMINAL_MAGNITUDE_UT))
    return np.full(part.n, one_magnitude(seen, otherwise_ut, WHAT, part.path))


def _temperature(log: Log) -> np.ndarray:
    if not log.has("temp_c"):
        raise InputError(must(WHAT, "given the temperature temp_c", "a log without it", log.path))
    return log["temp_c"]


def _shape(log: Log, given: Given) -> Ellipsoid:
    """A and b of one log: against the field where it is known, else the ellipsoid; rotation left out."""
    if log.has("bx_ut"):
        seen, field_ut = vector(log, WHAT, 4)
        found = linear_model(seen.y, field_ut)
        return Ellipsoid(np.linalg.cholesky(found.matrix.T @ found.matrix).T, found.offset_lsb)
    seen = scalar(log, WHAT)
    otherwise_ut = float(given.reference.get("magnitude_ut", NOMINAL_MAGNITUDE_UT))
    known = one_magnitude(seen, otherwise_ut, WHAT, log.path)
    require_seen(seen, known, log.path)
    return efficient(seen.y, known)
