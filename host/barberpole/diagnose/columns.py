"""What each absent effect would add to the readings: its derivatives at the null, carried through the fitted model.

Where the derivative at the null explains nothing (cross_field of demodulated readings is even in k) the secant to the
effect's typical size stands in. Effects with inner parameters bring several shapes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from barberpole.effects import STACK, Conditions, Effect, Setup
from barberpole.fit.fit import Fit
from barberpole.model import push, solve3

FLAT = 1e-3  # a derivative this small beside the secant explains nothing


@dataclass(frozen=True)
class Shape:
    """One form of an absent effect: columns (m, K, n) in LSB per parameter unit, and where a refit starts."""

    effect: Effect
    label: str
    columns: np.ndarray
    start: np.ndarray
    typical: np.ndarray
    settings: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Pathway:
    """The fitted model traversed once in one magnetisation: the input (3, n) and slope of every stage."""

    weight: float
    at: Conditions
    inputs: list[np.ndarray]
    slopes: list[np.ndarray | None]


@dataclass(frozen=True)
class Ground:
    """Where columns are evaluated: the field (3, n), the residual there (m, n), the pathways, and, for scalar
    references, the unit normal (3, n) of the surface of constant magnitude in reading space."""

    fit: Fit
    field: np.ndarray
    residual: np.ndarray
    pathways: list[Pathway]
    normal: np.ndarray | None
    order: tuple[str, ...]

    def baseline(self) -> np.ndarray:
        """(m, P, n): derivatives of the fitted model."""
        columns = self.fit.model.linearise(self.field, self.fit.p, self.fit.problem.seen.at)[1]
        return self.seen_through(columns[:, self.fit.free])

    def seen_through(self, columns: np.ndarray) -> np.ndarray:
        """(3, K, n) of readings -> (m, K, n) of residuals."""
        return columns if self.normal is None else np.einsum("in,ikn->kn", self.normal, columns)[None]


def ground_of(fit: Fit, extra: Sequence[Effect] = ()) -> Ground:
    """Traverse the fitted model at the true field, or at the fitted field brought to the known magnitude.

    The raw fitted field carries the reading's noise and would make columns that reproduce the residual itself.
    """
    seen = fit.problem.seen
    order = tuple(e.name for e in (*STACK, *extra))
    if seen.b_ut is not None:
        return Ground(fit, seen.b_ut, fit.problem.residual(fit.p), _pathways(fit, seen.b_ut), None, order)
    raw = fit.field()
    norm, known = np.linalg.norm(raw, axis=0), fit.problem.magnitude(slice(None))
    field_ut = raw * (known / norm)
    _, _, slope = fit.model.linearise(field_ut, fit.p, seen.at, field_too=True)
    normal = solve3(slope.transpose(1, 0, 2), field_ut / known)  # gradient of |B| with respect to the reading
    steep = np.linalg.norm(normal, axis=0)
    return Ground(fit, field_ut, ((norm - known) / steep)[None], _pathways(fit, field_ut), normal / steep, order)


def _pathways(fit: Fit, field_ut: np.ndarray) -> list[Pathway]:
    at = fit.problem.seen.at
    known = np.asarray(at.state, float)
    if fit.model.unflipped:
        states = [(1.0, np.where(known == 0, 1.0, known))]
    elif np.all(known != 0):
        states = [(1.0, known)]
    else:
        states = [(0.5, np.where(known == 0, s, known)) for s in (1.0, -1.0)]
    return [_traverse(fit, field_ut, weight, replace(at, state=state)) for weight, state in states]


def _traverse(fit: Fit, field_ut: np.ndarray, weight: float, at: Conditions) -> Pathway:
    inputs, slopes = [field_ut], []
    for term in fit.model.terms:
        p = fit.p[term.at]
        slopes.append(term.effect.derivatives(inputs[-1], p, at)[0])
        inputs.append(np.asarray(term.effect.forward(inputs[-1], p, at)))
    return Pathway(weight, at, inputs, slopes)


def shape_of(ground: Ground, effect: Effect, setup: Setup, label: str = "") -> Shape:
    """The columns of an absent effect."""
    params = effect.params(setup)
    null = np.array([q.null for q in params])
    typical = np.array([q.typical or 1.0 for q in params])
    columns = _derivative(ground, effect, null)
    flat = np.sqrt(np.sum(columns**2, axis=(0, 2))) * np.abs(typical)
    for j in np.flatnonzero(flat <= FLAT * flat.max(initial=0.0) + 1e-30):
        columns[:, j] = _secant(ground, effect, null, j, typical[j])
    start = np.array([q.first for q in params])
    return Shape(effect, label or effect.name, ground.seen_through(columns), start, typical, dict(setup.settings))


def _derivative(ground: Ground, effect: Effect, p: np.ndarray) -> np.ndarray:
    total = 0.0
    for path in ground.pathways:
        stage = _stage(ground, effect)
        d_p = effect.derivatives(path.inputs[stage], p, path.at)[1]
        total = total + path.weight * _carry(path, stage, d_p)
    return np.asarray(total)


def _secant(ground: Ground, effect: Effect, null: np.ndarray, j: int, size: float) -> np.ndarray:
    p = null.copy()
    p[j] += size
    total = 0.0
    for path in ground.pathways:
        stage = _stage(ground, effect)
        xyz = path.inputs[stage]
        change = np.asarray(effect.forward(xyz, p, path.at)) - np.asarray(effect.forward(xyz, null, path.at))
        total = total + path.weight * _carry(path, stage, change[:, None] / size)[:, 0]
    return np.asarray(total)


def _stage(ground: Ground, effect: Effect) -> int:
    """How many of the model's terms come before the effect."""
    place = ground.order.index(effect.name)
    return sum(ground.order.index(name) < place for name in ground.fit.model.effects)


def _carry(path: Pathway, stage: int, columns: np.ndarray) -> np.ndarray:
    """Columns (3, K, n) at a stage, as they arrive in the reading."""
    for slope in path.slopes[stage:]:
        if slope is not None:
            columns = push(slope, columns)
    return columns
