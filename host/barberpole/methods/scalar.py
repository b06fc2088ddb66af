"""The published scalar methods on a log: their answer as bias, scale and misalignment, judged like any other fit."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from barberpole.errors import InputError
from barberpole.fit.fit import NOMINAL_MAGNITUDE_UT
from barberpole.fit.spikes import isolated, no_surface
from barberpole.fit.start import Linear
from barberpole.fit.usable import require_one_field
from barberpole.log import Log
from barberpole.methods.answer import Answer, Given, Values, matrix_values, per_axis, value
from barberpole.methods.ellipsoid import Ellipsoid, algebraic, certainty, coverage_message, efficient
from barberpole.methods.guards import (
    LEAST_ROWS,
    require_determined,
    require_no_spikes,
    require_no_stretch,
    require_rows,
)
from barberpole.methods.iterative import iterative
from barberpole.methods.readings import LINEAR_EFFECTS, judged, one_magnitude, scalar
from barberpole.modelfile import ModelFile
from barberpole.observations import Observations

WHAT = "an ellipsoid fit"
NOT_KNOWN = (
    f"K is not known: with the {NOMINAL_MAGNITUDE_UT:g} µT assumed, L and the field are right but for a common factor "
    "(--magnitude, or --place and --date, says it)"
)


def ellipsoid(log: Log, given: Given) -> Answer:
    """Two-step ellipsoid (thesis 4.8-4.20), sharpened to the Cramér-Rao bound, of a log whose field has one magnitude.

    The reference may give magnitude_ut; else the log's b_ut, else 50 µT with gains relative to it.
    Raises InputError when the log does not surround the sensor, saying what is missing.
    """
    shapes = []

    def shape_of(reading: np.ndarray, known: float) -> Ellipsoid:
        shapes.extend((algebraic(reading, known), efficient(reading, known)))
        return shapes[-1]

    answer, seen, known = _answer(log, given, shape_of)
    first, last = (1000.0 * _misfit_rms(shape, seen, known) for shape in shapes)
    note = f"|H| - K rms: {first:.5g} nT after the algebraic step, {last:.5g} nT after the last"
    return replace(answer, notes=(*answer.notes, note))


def ellipsoid_algebraic(log: Log, given: Given) -> Answer:
    """The closed form alone (thesis 4.19), with its bias of order sigma²/K."""
    return _answer(log, given, algebraic)[0]


def iterative_ellipsoid(log: Log, given: Given) -> Answer:
    """The iterative ellipsoid (thesis 4.21-4.22). Raises InputError as `ellipsoid`, and where it does not settle."""
    rounds = []

    def shape_of(reading: np.ndarray, known: float) -> Ellipsoid:
        found = iterative(reading, known)
        if not found.settled:
            raise InputError(f"{coverage_message(reading)}; {found.rounds} rounds of eq. 4.21 do not settle")
        rounds.append(found.rounds)
        return found.shape

    answer = _answer(log, given, shape_of)[0]
    return replace(answer, notes=(*answer.notes, f"settled after {rounds[0]} rounds of eq. 4.21"))


def _answer(log: Log, given: Given, shape_of: Callable) -> tuple[Answer, Observations, float]:
    file = ModelFile(LINEAR_EFFECTS, reference=given.reference)
    seen = scalar(log, WHAT)
    otherwise_ut = float(given.reference.get("magnitude_ut", NOMINAL_MAGNITUDE_UT))
    known = one_magnitude(seen, otherwise_ut, WHAT, log.path)
    require_seen(seen, known, log.path)
    shape = shape_of(seen.y, known)
    fit = judged(Linear(np.linalg.inv(shape.upper), shape.centre, known), seen, known)
    is_known = seen.b_mag is not None or "magnitude_ut" in given.reference
    values = _values(shape, seen, known) | {"K": value(known, 0.0 if is_known else np.nan, "uT")}
    return Answer(values, fit, file, () if is_known else (NOT_KNOWN,)), seen, known


def _values(shape: Ellipsoid, seen: Observations, known: float) -> Values:
    """L of 4.18 in µT/LSB, b of 4.20 in LSB, with the standard errors that the residual implies."""
    stderr = np.sqrt(np.diag(certainty(seen.y, shape, known)[1]))
    upper = np.zeros((3, 3))
    upper[np.triu_indices(3)] = stderr[:6]
    return matrix_values("L", shape.upper, upper, "uT/LSB") | per_axis("b", shape.centre, stderr[6:], "LSB")


def _misfit_rms(shape: Ellipsoid, seen: Observations, known: float) -> float:
    """RMS of |H| - K over the readings, µT."""
    return float(np.sqrt(np.mean((np.linalg.norm(shape.field(seen.y), axis=0) - known) ** 2)))


def require_seen(seen: Observations, known: float, where: object = "") -> None:
    """Raise InputError where readings in a field of one magnitude do not determine an ellipsoid, or spikes rule it."""
    require_rows(seen.y.shape[1], LEAST_ROWS, WHAT, where)
    shape = _surface(seen.y, known, where)
    left = np.linalg.norm(shape.field(seen.y), axis=0) - known
    require_no_spikes(left, known, where)
    require_no_stretch(left, where)
    require_one_field(1.0 + left / known, [], seen.row)
    require_determined(shape, seen.y, known)


def _surface(reading: np.ndarray, known: float, where: object) -> Ellipsoid:
    """The algebraic ellipsoid. Raises InputError that names spikes where these leave none."""
    try:
        return algebraic(reading, known)
    except InputError:
        if isolated(reading).any():
            raise InputError(f"{no_surface(reading)} ({where})") from None
        raise
