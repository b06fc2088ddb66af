"""The linearity measurement of the article on one or many logs: sensitivities, angles, offset, residuals, drifts."""

from dataclasses import dataclass

import numpy as np

from barberpole.characterise.angles import alignment_error_deg, heading_error_deg
from barberpole.characterise.kinds import Sorted
from barberpole.characterise.temperature import OFFSET_DEGREE, SENSITIVITY_DEGREE, Course, course
from barberpole.fit.fit import NOMINAL_MAGNITUDE_UT
from barberpole.log import Log
from barberpole.methods.ellipsoid import Ellipsoid, cramer_rao, efficient
from barberpole.methods.linear import LinearModel, decompose, linear_model, linear_values
from barberpole.methods.polynomial import choose, polynomial_model
from barberpole.methods.readings import one_magnitude, scalar, vector

WHAT = "characterise"
AT_C = 25.0
LEVEL_UT = 1.0  # least horizontal field for which a heading means something
STEADY_K = 3.0  # range of temperature of one linearity measurement


@dataclass(frozen=True)
class Linearity:
    """Figures of table 1 per axis (3,): sensitivity nT/LSB, angles xy, xz, yz in degrees, offset in nT.

    errors: (name, value, unit) of what is left; residual_ut (3, n), polynomial_ut (3, n), field_ut (3, n) for fig. 5,
    None for a sensor that was turned by hand.
    """

    sensitivity_nt: np.ndarray
    sensitivity_stderr_nt: np.ndarray
    angle_deg: np.ndarray
    angle_stderr_deg: np.ndarray
    offset_nt: np.ndarray
    offset_stderr_nt: np.ndarray
    errors: tuple[tuple[str, float, str], ...] = ()
    notes: tuple[str, ...] = ()
    field_ut: np.ndarray | None = None
    residual_ut: np.ndarray | None = None
    polynomial_ut: np.ndarray | None = None


def linearity(of: Sorted) -> Linearity | None:
    """From the log with an applied field nearest to 25 °C, else from one turned by hand; None without either."""
    if of.linear:
        return _against_field(min(of.linear, key=_from_25))
    return _turned(of.turned[0]) if of.turned else None


def _from_25(log: Log) -> float:
    temp = log.get("temp_c")
    return 0.0 if temp is None else abs(float(np.mean(temp)) - AT_C)


def _against_field(log: Log) -> Linearity:
    seen, field_ut = vector(log, WHAT, 4)
    line = linear_model(seen.y, field_ut)
    degrees, _ = choose(seen.y, field_ut)
    bent = polynomial_model(seen.y, field_ut, degrees)
    straight, better = line.field(seen.y), bent.field(seen.y)
    values = linear_values(line)
    pick = [np.array([values[f"{name}.{k}"].value for k in keys]) for name, keys in _NAMES]
    error = [np.array([values[f"{name}.{k}"].stderr for k in keys]) for name, keys in _NAMES]
    m, n = degrees
    return Linearity(
        pick[0],
        error[0],
        pick[1],
        error[1],
        pick[2] * pick[0],
        error[2] * pick[0],
        _errors("linear", straight, field_ut) + _errors("polynomial", better, field_ut),
        (f"{log.path.name}: polynomial of m = {m}, n = {n} by held-out error",),
        field_ut,
        straight - field_ut,
        better - field_ut,
    )


_NAMES = (("sensitivity", "xyz"), ("misalignment", ("xy", "xz", "yz")), ("offset", "xyz"))


def _errors(model: str, found: np.ndarray, true: np.ndarray) -> tuple[tuple[str, float, str], ...]:
    """Residual in nT by component, error of direction and of heading in degrees, rms."""
    strong = np.linalg.norm(true, axis=0) > LEVEL_UT
    level = np.hypot(true[0], true[1]) > LEVEL_UT
    out = [(f"residual, {model}", 1000.0 * _rms(found - true), "nT")]
    if strong.any():
        out.append((f"alignment error, {model}", _rms(alignment_error_deg(found[:, strong], true[:, strong])), "°"))
    if level.any():
        out.append((f"heading error, {model}", _rms(heading_error_deg(found[:, level], true[:, level])), "°"))
    return tuple(out)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _turned(log: Log) -> Linearity:
    """From the ellipsoid: sensitivities relative to its K, misalignment without the rotation."""
    seen = scalar(log, WHAT)
    known = one_magnitude(seen, NOMINAL_MAGNITUDE_UT, WHAT, log.path)
    shape = efficient(seen.y, known)
    misfit = np.linalg.norm(shape.field(seen.y), axis=0) - known
    covariance = np.zeros((12, 12))
    rows = np.array([0, 1, 2, 5, 6, 10, 3, 7, 11])  # L11 L12 L13 L22 L23 L33 b in rows of (M | .)
    gain = float(np.mean(np.linalg.norm(np.linalg.inv(shape.upper), axis=1)))
    crb = cramer_rao(seen.y, shape, known, _rms(misfit) * gain)
    covariance[np.ix_(rows, rows)] = _to_constant(crb, shape)
    values = linear_values(LinearModel(shape.upper, shape.centre, covariance))
    parts = decompose(shape.upper)
    pick = [np.array([values[f"{name}.{k}"].stderr for k in keys]) for name, keys in _NAMES]
    note = "" if seen.b_mag is not None else f"; sensitivities are relative to |B| = {known:g} µT"
    nt = 1000.0 * parts.sensitivity
    return Linearity(
        nt,
        pick[0],
        parts.angle_deg,
        pick[1],
        shape.centre * nt,
        pick[2] * nt,
        (("residual of the norm", 1000.0 * _rms(misfit), "nT"),),
        (f"{log.path.name}: ellipsoid{note}",),
    )


def _to_constant(covariance: np.ndarray, shape: Ellipsoid) -> np.ndarray:
    """Covariance (9, 9) of L and b as that of L and c = -L b: dc_i = -sum_j (L_ij db_j + b_j dL_ij)."""
    change = np.eye(9)
    change[6:, 6:] = -shape.upper
    for column, (i, j) in enumerate(zip(*np.triu_indices(3), strict=True)):
        change[6 + i, column] = -shape.centre[j]
    return change @ covariance @ change.T


def temperature_courses(of: Sorted) -> tuple[tuple[str, str, Course], ...]:
    """Sensitivity (quadratic, nT/LSB) and offset (linear, nT) of each axis over temperature; empty for too few logs."""
    logs = [log for log in of.linear if log.has("temp_c") and np.ptp(log["temp_c"]) <= STEADY_K]
    if len({round(float(np.mean(log["temp_c"]))) for log in logs}) < SENSITIVITY_DEGREE + 2:
        return ()
    temp = np.array([float(np.mean(log["temp_c"])) for log in logs])
    models = [linear_model(seen.y, field) for seen, field in (vector(log, WHAT, 4) for log in logs)]
    sensitivity = 1000.0 * np.array([decompose(m.matrix).sensitivity for m in models])
    offset = np.array([m.offset_lsb for m in models]) * sensitivity
    out = [("sensitivity", a, course(temp, sensitivity[:, i], SENSITIVITY_DEGREE)) for i, a in enumerate("xyz")]
    return tuple(out + [("offset", a, course(temp, offset[:, i], OFFSET_DEGREE)) for i, a in enumerate("xyz")])
