"""A log as the published methods see it: one demodulated reading a row, and what is known of the field."""

from dataclasses import replace

import numpy as np

from barberpole.columns import READINGS
from barberpole.errors import InputError, must
from barberpole.fit.fit import Fit, setup_of
from barberpole.fit.gram import accumulate
from barberpole.fit.observability import covariance
from barberpole.fit.residual import Problem
from barberpole.fit.start import Linear, start_values
from barberpole.fit.usable import require_in_range, require_microtesla, require_one_field
from barberpole.log import Log
from barberpole.methods.guards import require_moving, require_no_spikes, require_no_stretch
from barberpole.model import compose
from barberpole.observations import Observations, observations

LINEAR_EFFECTS = ("bias", "scale", "misalignment")
SAME = 1e-3  # relative spread of a field magnitude that still counts as one
NEAR_NULL = 0.1  # of the largest applied field: below it a ratio to it says nothing
FLAT = 1e-3  # smallest over largest direction of an applied field that still spans space


def demodulated(log: Log, what: str) -> Observations:
    """One reading a row. `what` names the method in the refusal of SET and RESET taken in turns."""
    plain = replace(log, columns={n: v for n, v in log.columns.items() if "_set_" not in n and "_reset_" not in n})
    seen = observations(plain)
    states = np.unique(seen.at.state)
    if (1.0 in states and -1.0 in states) or not log.has(*READINGS):
        got = "SET and RESET in turns in x_lsb.. (fit --model takes them)"
        raise InputError(must(what, "given demodulated readings", got, log.path))
    require_moving(seen.y, what, log.path)
    require_in_range(seen.y)
    return seen


def scalar(log: Log, what: str) -> Observations:
    """The same with at most the magnitude of the field."""
    seen = demodulated(log, what)
    magnitude = np.linalg.norm(seen.b_ut, axis=0) if seen.b_ut is not None else seen.b_mag
    return replace(seen, b_ut=None, b_mag=magnitude, reference="constant" if magnitude is None else "magnitude")


def one_magnitude(seen: Observations, otherwise_ut: float, what: str, where: object) -> float:
    """K in µT: the log's, or `otherwise_ut`. Raises InputError if the log's is not one number."""
    known = otherwise_ut if seen.b_mag is None else float(np.mean(seen.b_mag))
    require_microtesla(known)
    if seen.b_mag is None:
        return known
    if np.ptp(seen.b_mag) > SAME * known:
        got = f"b_ut from {seen.b_mag.min():.4g} to {seen.b_mag.max():.4g} µT (fit --model takes them all)"
        raise InputError(must(what, "given one field magnitude", got, where))
    return known


def vector(log: Log, what: str, parameters: int) -> tuple[Observations, np.ndarray]:
    """Readings with the applied field (3, n) in µT. Raises InputError without one, or where it does not span space.

    parameters  of the method for each axis: there must be as many different fields
    """
    seen = demodulated(log, what)
    if seen.b_ut is None:
        raise InputError(must(what, "given the applied field bx_ut, by_ut, bz_ut", "a log without it", log.path))
    _require_span(seen.b_ut, what, parameters, log.path)
    require_microtesla(float(np.max(np.linalg.norm(seen.b_ut, axis=0))))
    require_regular(seen.y, seen.b_ut, log.path)
    return seen, seen.b_ut


def require_regular(reading: np.ndarray, field_ut: np.ndarray, where: object) -> None:
    """Raise InputError where spikes, one stretch or a second field rule a fit of readings (3, n) and fields (3, n).

    The readings are regressed on the field, which is free of errors, so that a spike cannot hide by its leverage.
    """
    columns = np.vstack([field_ut, np.ones(field_ut.shape[1])]).T
    found = np.linalg.lstsq(columns, reading.T, rcond=None)[0]
    left = (reading.T - columns @ found).T
    require_no_spikes(left, float(np.max(np.ptp(reading, axis=1))), where)
    require_no_stretch(left, where)
    size = np.linalg.norm(field_ut, axis=0)
    usable = size > NEAR_NULL * size.max()
    seen = np.linalg.norm(np.linalg.pinv(found[:3].T) @ (reading - found[3][:, None]), axis=0)
    require_one_field(np.where(usable, seen / np.where(usable, size, 1.0), 1.0), [], np.arange(size.size))


def _require_span(field_ut: np.ndarray, what: str, parameters: int, where: object) -> None:
    about = field_ut - field_ut.mean(axis=1, keepdims=True)
    size = np.linalg.svd(about @ about.T, compute_uv=False)
    if not size[2] > FLAT**2 * size[0]:
        flat = "a plane" if size[1] > FLAT**2 * size[0] else "a line"
        raise InputError(must(what, "given fields that span all three axes", f"fields in {flat}", where))
    different = len(np.unique(np.round(field_ut, 6), axis=1).T)
    if different <= parameters:
        wanted = f"given more different fields than its {parameters} parameters an axis"
        raise InputError(must(what, wanted, f"{different}", where))


def judged(linear: Linear, seen: Observations, magnitude_ut: float = 50.0) -> Fit:
    """reading = matrix @ field + offset as bias, scale and misalignment, judged on the log like any other fit."""
    setups = {name: setup_of(seen, linear) for name in LINEAR_EFFECTS}
    model = compose(LINEAR_EFFECTS, setups)
    problem = Problem(model, seen, magnitude_ut)
    p = start_values(model, linear)
    gram, free = accumulate(problem, p), np.ones(len(p), bool)
    return Fit(problem, p, covariance(gram, free), gram, free, True, linear, setups)
