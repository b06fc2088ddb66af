"""Where a fit starts: the linear part in closed form, everything else at its null (or `start`)."""

from dataclasses import dataclass

import numpy as np

from barberpole.effects.misalignment import LOWER, UPPER
from barberpole.fit.ellipsoid import Ellipsoid, algebraic
from barberpole.model import Model
from barberpole.observations import Observations

FAR = 8.0  # times the median distance from the ellipsoid; of normal noise 5.4 standard deviations
TRIMS = 8


@dataclass(frozen=True)
class Linear:
    """reading = matrix @ field + offset: (3, 3) in LSB/µT, (3,) in LSB, and the largest field component seen in µT."""

    matrix: np.ndarray
    offset: np.ndarray
    span_ut: float

    @property
    def lsb_per_ut(self) -> float:
        """Mean gain of the axes."""
        return float(np.mean(np.sqrt(np.sum(self.matrix**2, axis=1))))


def linear_part(seen: Observations, magnitude_ut: float) -> Linear:
    """Closed-form start: least squares against a known field, the algebraic ellipsoid against a known magnitude."""
    if seen.b_ut is not None:
        return _against_field(seen.y, seen.b_ut)
    known = float(np.mean(seen.b_mag)) if seen.b_mag is not None else magnitude_ut
    shape = trimmed(seen.y, known)
    return Linear(np.linalg.inv(shape.upper), shape.centre, known)


def trimmed(y: np.ndarray, magnitude_ut: float) -> Ellipsoid:
    """The algebraic ellipsoid of readings (3, n), repeated without those far off it: its squares square an outlier."""
    shape, kept = algebraic(y, magnitude_ut), np.ones(y.shape[1], bool)
    for _ in range(TRIMS):
        apart = np.abs(np.linalg.norm(shape.field(y), axis=0) - magnitude_ut)
        near = apart <= FAR * float(np.median(apart))
        if np.array_equal(near, kept) or np.mean(near) < 0.5:
            break
        shape, kept = algebraic(y[:, near], magnitude_ut), near
    return shape


def _against_field(y: np.ndarray, field_ut: np.ndarray) -> Linear:
    columns = np.vstack([field_ut, np.ones(field_ut.shape[1])])
    gram = columns @ columns.T
    # directions the field never took are left out by the pseudo-inverse, for observability to name
    answer = y @ columns.T @ np.linalg.pinv(gram, rcond=1e-9, hermitian=True)
    return Linear(answer[:, :3], answer[:, 3], float(np.max(np.abs(field_ut))))


def start_values(model: Model, linear: Linear) -> np.ndarray:
    """Parameter vector (P,) with scale, misalignment and bias from the linear part."""
    p = model.first.copy()
    gain = np.sqrt(np.sum(linear.matrix**2, axis=1))
    sign = np.where(np.diag(linear.matrix) < 0, -1.0, 1.0)
    aligned = "misalignment" in model.effects
    own = np.diag(linear.matrix)
    values = {f"bias.{a}": linear.offset[i] for i, a in enumerate("xyz")}
    for i, a in enumerate("xyz"):
        values[f"scale.{a}"] = sign[i] * gain[i] if aligned else own[i]
        for j, b in enumerate("xyz"):
            if i != j and a + b in UPPER + LOWER and abs(own[i]) > 1e-3 * gain[i]:
                values[f"misalignment.{a}{b}"] = linear.matrix[i, j] / own[i]
    for at, name in enumerate(model.names):
        value = values.get(name)
        if value is not None and np.isfinite(value) and not (name.startswith("scale") and value == 0.0):
            p[at] = value
    lower, upper = model.bounds()
    return np.clip(p, lower, upper)
