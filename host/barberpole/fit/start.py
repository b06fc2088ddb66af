"""Where a fit starts: the linear part in closed form, everything else at its null (or `start`)."""

import math
from dataclasses import dataclass, field

import numpy as np

from barberpole.effects.misalignment import LOWER, UPPER
from barberpole.errors import InputError
from barberpole.fit.affine import Moments, moments
from barberpole.fit.ellipsoid import Ellipsoid, algebraic
from barberpole.fit.few import few
from barberpole.fit.spikes import isolated
from barberpole.model import Model
from barberpole.observations import Observations

FAR = 8.0  # times the median distance from the ellipsoid; of normal noise 5.4 standard deviations
TRIMS = 8


@dataclass(frozen=True)
class Linear:
    """reading = matrix @ field + offset: (3, 3) in LSB/µT, (3,) in LSB, and the largest field component seen in µT.

    bridge (3,) in LSB is what SET readings have more, and RESET readings less, in logs of raw polarity.
    """

    matrix: np.ndarray
    offset: np.ndarray
    span_ut: float
    bridge: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @property
    def lsb_per_ut(self) -> float:
        """Mean gain of the axes."""
        return float(np.mean(np.sqrt(np.sum(self.matrix**2, axis=1))))


def linear_part(seen: Observations, magnitude_ut: float, known_moments: Moments | None = None) -> Linear:
    """Closed-form start: least squares against a known field, the algebraic ellipsoid against a known magnitude."""
    if seen.b_ut is not None:
        best = (known_moments or moments(seen.y, seen.b_ut)).best()
        return Linear(best[:, 1:], best[:, 0], max(float(np.max(seen.b_ut)), -float(np.min(seen.b_ut))))
    known = float(np.mean(seen.b_mag)) if seen.b_mag is not None else magnitude_ut
    bridge = _bridge(seen)
    shape = trimmed(seen.y - seen.at.state * bridge[:, None] if bridge.any() else seen.y, known)
    return Linear(np.linalg.inv(shape.upper), shape.centre, known, bridge)


def _bridge(seen: Observations) -> np.ndarray:
    """(3,) LSB: half of what SET readings have over RESET readings on average, the fields of both being alike.

    A bridge's own offset may be many times the field: with it in the readings they lie on two ellipsoids.
    """
    state = np.broadcast_to(np.asarray(seen.at.state, float), seen.y.shape[1:])
    if not (seen.raw_polarity and np.any(state > 0) and np.any(state < 0)):
        return np.zeros(3)
    return 0.5 * (np.median(seen.y[:, state > 0], axis=1) - np.median(seen.y[:, state < 0], axis=1))


def trimmed(y: np.ndarray, magnitude_ut: float) -> Ellipsoid:
    """The algebraic ellipsoid of readings (3, n), repeated without those far off it: its squares square an outlier."""
    shape, kept = _first(y, magnitude_ut), np.ones(y.shape[1], bool)
    for _ in range(TRIMS):
        field = shape.field(y)
        size2 = np.einsum("ik,ik->k", field, field)
        far = FAR * float(np.median(np.abs(np.sqrt(size2[few(size2.size)]) - magnitude_ut)))
        near = (size2 <= (magnitude_ut + far) ** 2) & (size2 >= max(magnitude_ut - far, 0.0) ** 2)
        if np.array_equal(near, kept) or np.count_nonzero(near) < 0.5 * near.size:
            break
        shape, kept = algebraic(y[:, near], magnitude_ut), near
    return shape


def _first(y: np.ndarray, magnitude_ut: float) -> Ellipsoid:
    """Through all readings, or where they allow none, through those that are no spikes."""
    try:
        return algebraic(y, magnitude_ut)
    except InputError:
        alone = isolated(y)
        if not alone.any():
            raise
    return algebraic(y[:, ~alone], magnitude_ut)


def start_values(model: Model, linear: Linear) -> np.ndarray:
    """Parameter vector (P,) with scale, misalignment and bias from the linear part."""
    p = model.first.copy()
    gain = np.sqrt(np.sum(linear.matrix**2, axis=1))
    sign = np.where(np.diag(linear.matrix) < 0, -1.0, 1.0)
    aligned = "misalignment" in model.effects
    own = np.diag(linear.matrix)
    values = {f"bias.{a}": linear.offset[i] for i, a in enumerate("xyz")}
    values |= {f"bias.bridge_{a}": linear.bridge[i] for i, a in enumerate("xyz")}
    for i, a in enumerate("xyz"):
        values[f"scale.{a}"] = sign[i] * gain[i] if aligned else own[i]
        for j, b in enumerate("xyz"):
            if i != j and a + b in UPPER + LOWER and abs(own[i]) > 1e-3 * gain[i]:
                values[f"misalignment.{a}{b}"] = linear.matrix[i, j] / own[i]
    for at, name in enumerate(model.names):
        value = values.get(name)
        if value is not None and math.isfinite(value) and not (name.startswith("scale") and value == 0.0):
            p[at] = value
    lower, upper = model.bounds()
    return np.minimum(np.maximum(p, lower), upper)
