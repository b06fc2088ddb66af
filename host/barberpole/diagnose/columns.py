"""What each absent effect would add to the readings: its derivatives at the null, carried through the fitted model.

Where the derivative at the null explains nothing (cross_field of demodulated readings is even in k) the secant to the
effect's typical size stands in. Effects with inner parameters bring several forms.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from barberpole.chain import UNIT, add_columns, full, solve3, sum_slopes, through
from barberpole.effects import Conditions, Effect, Setup, in_order
from barberpole.effects.effect import Shape, spread
from barberpole.fit.fit import Fit

FLAT = 1e-3  # a derivative this small beside the others of its effect explains nothing
NONE = np.zeros((3, 0, 1))


@dataclass(frozen=True)
class Candidate:
    """One form of an absent effect: columns (m, K, n) in LSB per parameter unit and the `names` of their parameters.

    start: of a refit, by name; linear: the least-squares weights are better ones. even: a parameter of no sign, whose
    column is a secant because its derivative at the null is zero.
    """

    effect: Effect
    setup: Setup
    columns: np.ndarray
    names: tuple[str, ...]
    typical: np.ndarray
    linear: bool
    even: np.ndarray
    start: dict[str, float]
    tried: int = 1


@dataclass(frozen=True)
class Pathway:
    """The fitted model traversed once in one magnetisation. Stage i takes inputs[i]; tails[i] is the slope of the
    reading by that input. The last input is the reading itself."""

    weight: float
    at: Conditions
    inputs: list[np.ndarray]
    slopes: list[np.ndarray | None]
    tails: list[np.ndarray]


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
        if self.normal is None:
            return columns
        u, v, w = self.normal
        return (u * columns[0] + v * columns[1] + w * columns[2])[None]

    def unflipped(self) -> "Ground":
        """The same with readings of unknown state taken as of one magnetisation."""
        if len(self.pathways) == 1:
            return self
        return replace(self, pathways=[replace(self.pathways[0], weight=1.0)])


def ground_of(fit: Fit, extra: Sequence[Effect] = ()) -> Ground:
    """Traverse the fitted model at the true field, or at the fitted field brought to the known magnitude.

    The raw fitted field carries the reading's noise and would make columns that reproduce the residual itself.
    """
    seen = fit.problem.seen
    order = tuple(e.name for e in in_order(extra))
    believed = 1.0 if fit.problem.believed is None else fit.problem.believed
    if seen.b_ut is not None:
        return Ground(fit, seen.b_ut, believed * fit.problem.residual(fit.p), _pathways(fit, seen.b_ut), None, order)
    raw = fit.field()
    norm, known = np.linalg.norm(raw, axis=0), fit.problem.magnitude(slice(None))
    field_ut = raw * (known / norm)
    paths = _pathways(fit, field_ut)
    slope = None
    for path in paths:
        slope = sum_slopes(slope, path.weight * path.tails[0])
    transposed = np.swapaxes(full(np.asarray(slope), norm.size), 0, 1)
    normal = solve3(transposed, field_ut / known)  # gradient of |B| with respect to the reading
    steep = np.linalg.norm(normal, axis=0)
    return Ground(fit, field_ut, believed * ((norm - known) / steep)[None], paths, normal / steep, order)


def _pathways(fit: Fit, field_ut: np.ndarray) -> list[Pathway]:
    at = fit.problem.seen.at
    known = np.asarray(at.state, float)
    if np.all(known != 0):
        states = [(1.0, known)]
    elif fit.model.unflipped:
        states = [(1.0, np.where(known == 0, 1.0, known))]
    else:
        states = [(0.5, np.where(known == 0, s, known)) for s in (1.0, -1.0)]
    return [_traverse(fit, field_ut, weight, replace(at, state=state)) for weight, state in states]


def _traverse(fit: Fit, field_ut: np.ndarray, weight: float, at: Conditions) -> Pathway:
    inputs, slopes = [field_ut], []
    for term in fit.model.terms:
        out, d_in, _ = term.effect.linearise(inputs[-1], fit.p[term.at], at)
        inputs.append(out)
        slopes.append(d_in)
    tails = [UNIT]
    for d_in in reversed(slopes):
        tails.insert(0, through(tails[0], d_in))
    return Pathway(weight, at, inputs, slopes, tails)


def candidate(ground: Ground, effect: Effect, shape: Shape, settings: dict[str, Any], setup: Setup) -> Candidate:
    """One form of an absent effect as columns."""
    if settings.get("form") == "unflipped":
        ground = ground.unflipped()
    params = effect.params(setup)
    names = [q.name for q in params]
    null = np.array([shape.inner.get(q.name, q.null) for q in params])
    wanted = np.array([q.name in shape.columns if shape.columns else not q.inner for q in params])
    typical = np.array([q.typical or 1.0 for q in params])
    columns, even = _columns(ground, effect, null, typical, wanted, float(shape.secant))
    columns = ground.seen_through(columns)
    start = {
        q.name: q.null + shape.secant * t if shape.secant else q.first for q, t in zip(params, typical, strict=True)
    }
    start |= shape.inner
    picked = tuple(name for name, w in zip(names, wanted, strict=True) if w)
    return Candidate(effect, setup, columns, picked, typical[wanted], not shape.secant, even, start, shape.tried)


def _columns(ground, effect, null, typical, wanted, secant: float) -> tuple[np.ndarray, np.ndarray]:
    """(3, K, n) for the wanted parameters, and which of them are even."""
    picked = np.flatnonzero(wanted)
    if secant:
        columns = [_secant(ground, effect, null, int(j), secant * typical[j]) for j in picked]
        return np.stack(columns, axis=1), np.zeros(picked.size, bool)
    columns = _derivative(ground, effect, null)[:, picked]
    size = np.sqrt(np.sum(columns**2, axis=(0, 2))) * np.abs(typical[picked])
    even = size <= FLAT * size.max(initial=0.0)
    for i in np.flatnonzero(even):
        columns[:, i] = _secant(ground, effect, null, int(picked[i]), typical[picked[i]])
    return columns, even


def _derivative(ground: Ground, effect: Effect, p: np.ndarray) -> np.ndarray:
    stage, n = _stage(ground, effect), ground.field.shape[1]
    total = np.zeros((3, len(p), n))
    for path in ground.pathways:
        d_p = effect.linearise(path.inputs[stage], p, path.at)[2]
        total += path.weight * _carry(ground, path, stage, d_p, n)
    return total


def _secant(ground: Ground, effect: Effect, null: np.ndarray, j: int, size: float) -> np.ndarray:
    p = null.copy()
    p[j] += size
    stage, n = _stage(ground, effect), ground.field.shape[1]
    total = np.zeros((3, n))
    for path in ground.pathways:
        xyz = path.inputs[stage]
        change = np.asarray(effect.forward(xyz, p, path.at)) - np.asarray(effect.forward(xyz, null, path.at))
        total += path.weight * _carry(ground, path, stage, change[:, None] / size, n)[:, 0]
    return total


def _stage(ground: Ground, effect: Effect) -> int:
    """How many of the model's terms come before the effect."""
    place = ground.order.index(effect.name)
    return sum(ground.order.index(name) < place for name in ground.fit.model.effects)


def _carry(ground: Ground, path: Pathway, stage: int, columns: np.ndarray, n: int) -> np.ndarray:
    """Columns at a stage as they reach the reading: (3, K, n), or (K, n) where parameter j acts on axis j % 3 alone."""
    terms = ground.fit.model.terms
    with_memory = [i for i in range(stage, len(terms)) if terms[i].effect.tangent]
    if not with_memory:
        out = np.zeros((3, columns.shape[-2], n))
        add_columns(out, path.tails[stage], columns)
        return out
    columns = np.broadcast_to(spread(columns) if columns.ndim == 2 else columns, (3, columns.shape[-2], n))
    for i in range(stage, len(terms)):
        columns = _through_stage(terms[i], path, i, columns, ground.fit.p)
    return columns


def _through_stage(term, path: Pathway, i: int, columns: np.ndarray, p: np.ndarray) -> np.ndarray:
    if term.effect.tangent:
        return term.effect.tangent(path.inputs[i], p[term.at], path.at, columns)
    if path.slopes[i] is None:
        return columns
    out = np.zeros(columns.shape)
    add_columns(out, np.asarray(path.slopes[i]), columns)
    return out
