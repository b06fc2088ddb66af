"""The linear vector calibration of the article (2.2.1): B_cal = M (B_mea - B_off), M = R W S.     (1)-(3)

S is diagonal: the length of each column of M, in µT/LSB. W is upper triangular with unit columns: the angles between
the base vectors that the columns are. R turns the sensor's frame into the coils'. So W S is M without its rotation,
and nine numbers of M are three sensitivities, three misalignment angles and three Euler angles.

M is found by least squares of the field, which is linear with B_off as the constant. The readings are the regressors,
so their noise shrinks M by sigma²/var(B_mea), 1e-5 at 1 LSB in 60 µT; the general fit regresses the readings.
The base vectors are the directions in which one axis reads and the other two do not; the directions that an axis is
sensitive to, the rows of M^-1, make the opposite angles to first order. `effects.misalignment` uses the latter.
"""

from dataclasses import dataclass

import numpy as np

from barberpole.errors import InputError, must
from barberpole.fit.start import Linear
from barberpole.log import Log
from barberpole.methods.answer import Answer, Given, Values, matrix_values, per_axis, value
from barberpole.methods.quality import FOLDS, stretches
from barberpole.methods.readings import LINEAR_EFFECTS, judged, vector
from barberpole.modelfile import ModelFile

WHAT = "the linear method"
PARAMETERS = 4  # of one axis: a row of M and a component of B_off
PAIRS = ((0, 1), (0, 2), (1, 2))
UNFOLLOWED = 0.5  # part of the field's variance that the readings may leave; a working sensor leaves 1e-4
STEP = 1e-7  # relative, of the numerical derivatives of angles by elements of M


@dataclass(frozen=True)
class LinearModel:
    """M (3, 3) in µT/LSB, B_off (3,) in LSB; covariance (12, 12) of the rows of (M | -M B_off)."""

    matrix: np.ndarray
    offset_lsb: np.ndarray
    covariance: np.ndarray

    def field(self, reading: np.ndarray) -> np.ndarray:
        """(3, n) µT of readings (3, n) in LSB, eq. 1."""
        return self.matrix @ (reading - self.offset_lsb[:, None])


@dataclass(frozen=True)
class Parts:
    """M = R W S (eq. 3): sensitivity (3,) µT/LSB, angle_deg (3,) of xy, xz, yz over 90°, euler_deg (3,) of Rz Ry Rx."""

    rotation: np.ndarray
    misalignment: np.ndarray
    sensitivity: np.ndarray
    angle_deg: np.ndarray
    euler_deg: np.ndarray


def linear_model(reading: np.ndarray, field_ut: np.ndarray) -> LinearModel:
    """Eq. 2 by linear least squares, from readings and applied fields (3, n). Raises InputError if rank is missing."""
    columns = np.vstack([reading, np.ones(reading.shape[1])])
    scale = np.maximum(np.abs(columns).max(axis=1), 1e-300)
    gram = (columns / scale[:, None]) @ (columns / scale[:, None]).T
    if np.linalg.cond(gram) > 1e12:
        raise InputError("the readings must follow the applied field on all three axes; got an axis that does not")
    solved = np.linalg.solve(gram, (columns / scale[:, None]) @ field_ut.T).T / scale
    left = field_ut - solved @ columns
    variance = np.sum(left**2, axis=1) / max(reading.shape[1] - PARAMETERS, 1)
    unit = np.linalg.inv(gram) / np.outer(scale, scale)
    offset = -np.linalg.solve(solved[:, :3], solved[:, 3])
    return LinearModel(solved[:, :3], offset, np.kron(np.diag(variance), unit))


def heldout(reading: np.ndarray, field_ut: np.ndarray) -> np.ndarray:
    """(3, n) µT: the error of each row by the model of the stretches without it."""
    fold, left = stretches(reading.shape[1]), np.empty(field_ut.shape)
    for k in range(FOLDS):
        out = fold == k
        left[:, out] = linear_model(reading[:, ~out], field_ut[:, ~out]).field(reading[:, out]) - field_ut[:, out]
    return left


def decompose(matrix: np.ndarray) -> Parts:
    """Eq. 3 of M (3, 3). Where the axes are left-handed, R is a rotation with a reflection."""
    q, u = np.linalg.qr(matrix)
    sign = np.where(np.diag(u) < 0, -1.0, 1.0)
    q, u = q * sign, u * sign[:, None]
    sensitivity = np.linalg.norm(u, axis=0)
    w = u / sensitivity
    cosines = np.array([w[:, i] @ w[:, j] for i, j in PAIRS])
    return Parts(q, w, sensitivity, np.degrees(np.arccos(np.clip(cosines, -1, 1))) - 90.0, _euler_deg(q))


def _euler_deg(r: np.ndarray) -> np.ndarray:
    """Angles about z, y, x of R = Rz Ry Rx, in degrees."""
    about_y = -np.arcsin(np.clip(r[2, 0], -1, 1))
    return np.degrees([np.arctan2(r[1, 0], r[0, 0]), about_y, np.arctan2(r[2, 1], r[2, 2])])


def linear(log: Log, given: Given) -> Answer:
    """The method on a log with an applied field. Raises InputError where the field is not known or does not span."""
    seen, field_ut = vector(log, WHAT, PARAMETERS)
    found = linear_model(seen.y, field_ut)
    require_followed(found, seen.y, field_ut, "the applied field", log.path)
    to_reading = Linear(np.linalg.inv(found.matrix), found.offset_lsb, float(np.max(np.abs(field_ut))))
    fit = judged(to_reading, seen)
    return Answer(linear_values(found), fit, ModelFile(LINEAR_EFFECTS, reference=given.reference))


def require_followed(found: LinearModel, reading: np.ndarray, field_ut: np.ndarray, what: str, where: object) -> None:
    """Raise InputError where the readings do not account for most of the field's variance on every axis."""
    left = np.var(found.field(reading) - field_ut, axis=1) / np.var(field_ut, axis=1)
    if np.max(left) > UNFOLLOWED:
        got = f"{100 * np.max(left):.0f} % of {'xyz'[int(np.argmax(left))]} not followed"
        raise InputError(must("the readings", f"such as follow {what}", got, where))


def linear_values(found: LinearModel) -> Values:
    """Sensitivities, misalignment and Euler angles, offset and W S, each with its standard error."""
    numbers, stderr = _with_errors(found)
    sensitivity, angle, euler, offset = np.split(numbers, 4)
    s_sensitivity, s_angle, s_euler, s_offset = np.split(stderr, 4)
    angles = {
        f"misalignment.{'xyz'[i]}{'xyz'[j]}": value(angle[k], s_angle[k], "deg") for k, (i, j) in enumerate(PAIRS)
    }
    turns = {f"rotation.{a}": value(euler[k], s_euler[k], "deg") for k, a in enumerate("zyx")}
    parts = decompose(found.matrix)
    return (
        per_axis("sensitivity", 1000.0 * sensitivity, 1000.0 * s_sensitivity, "nT/LSB")
        | angles
        | turns
        | per_axis("offset", offset, s_offset, "LSB")
        | matrix_values("WS", np.triu(parts.misalignment * parts.sensitivity), None, "uT/LSB")
    )


def _with_errors(found: LinearModel) -> tuple[np.ndarray, np.ndarray]:
    """Sensitivities, angles, Euler angles and offset (12,) with standard errors, carried over from the elements."""
    at = np.hstack([found.matrix, -(found.matrix @ found.offset_lsb)[:, None]]).ravel()
    base, slope = _figures(at), np.empty((12, 12))
    for j in range(12):
        step = STEP * max(abs(at[j]), float(np.abs(at[: j + 1]).max()))
        slope[:, j] = (_figures(at + step * np.eye(12)[j]) - base) / step
    return base, np.sqrt(np.maximum(np.diag(slope @ found.covariance @ slope.T), 0.0))


def _figures(elements: np.ndarray) -> np.ndarray:
    rows = elements.reshape(3, 4)
    parts = decompose(rows[:, :3])
    offset = -np.linalg.solve(rows[:, :3], rows[:, 3])
    return np.concatenate([parts.sensitivity, parts.angle_deg, parts.euler_deg, offset])
