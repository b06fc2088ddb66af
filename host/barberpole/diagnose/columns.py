"""What each absent effect would add to the readings: its derivatives at the null, carried through the fitted model.

Where the derivative at the null explains nothing (cross_field of demodulated readings is even in k) the secant to the
effect's typical size stands in. Effects with inner parameters bring several forms.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from barberpole.chain import UNIT, add_columns, full, solve3, sum_slopes, through
from barberpole.diagnose.table import Parts, parts_of
from barberpole.effects import Conditions, Effect, Setup, in_order
from barberpole.effects.effect import Shape, spread
from barberpole.fit.fit import Fit

FLAT = 1e-3  # a derivative this small beside the others of its effect explains nothing
NONE = np.zeros((3, 0, 1))


@dataclass(frozen=True)
class Candidate:
    """One form of an absent effect: its columns by channel in LSB per parameter unit, and the `names` of their
    parameters.

    start: of a refit, by name; linear: the least-squares weights are better ones. even: a parameter of no sign, whose
    column is a secant because its derivative at the null is zero.
    """

    effect: Effect
    setup: Setup
    parts: Parts
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

    def seen_by_channel(self, parts: Parts) -> Parts:
        """The same for columns by channel."""
        if self.normal is None:
            return parts
        count = max((int(index.max()) + 1 for index, _ in parts if index.size), default=0)
        total = np.zeros((count, self.field.shape[1]))
        for u, (index, rows) in zip(self.normal, parts, strict=True):
            total[index] += u * rows
        return [(np.arange(count), total)]

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
    first = null + shape.secant * typical if shape.secant else np.array([q.first for q in params])
    start = dict(zip(names, (float(v) for v in first), strict=True))
    start |= shape.inner
    picked = tuple(name for name, w in zip(names, wanted, strict=True) if w)
    return Candidate(
        effect,
        setup,
        ground.seen_by_channel(columns),
        picked,
        typical[wanted],
        not shape.secant,
        even,
        start,
        shape.tried,
    )


def _columns(ground, effect, null, typical, wanted, secant: float) -> tuple[Parts, np.ndarray]:
    """Readings' columns of the wanted parameters, and which of them are even."""
    picked = np.flatnonzero(wanted)
    if secant:
        columns = [_secant(ground, effect, null, int(j), secant * typical[j]) for j in picked]
        return parts_of(np.stack(columns, axis=1)), np.zeros(picked.size, bool)
    parts = [_only(index, rows, picked) for index, rows in _derivative(ground, effect, null)]
    energy = sum(np.bincount(i, np.einsum("kn,kn->k", r, r), picked.size) for i, r in parts)
    size = np.sqrt(np.asarray(energy)) * np.abs(typical[picked])
    even = size <= FLAT * np.max(size, initial=0.0)
    if not even.any():
        return parts, even
    dense = _dense(parts, picked.size, ground.field.shape[1])
    for i in np.flatnonzero(even):
        dense[:, i] = _secant(ground, effect, null, int(picked[i]), typical[picked[i]])
    return parts_of(dense), even


def _only(index: np.ndarray, rows: np.ndarray, picked: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The picked columns of one channel, renumbered."""
    kept = np.isin(index, picked)
    return np.searchsorted(picked, index[kept]), rows if kept.all() else rows[kept]


def _dense(parts: Parts, count: int, n: int) -> np.ndarray:
    out = np.zeros((len(parts), count, n))
    for channel, (index, rows) in enumerate(parts):
        out[channel, index] = rows
    return out


def _derivative(ground: Ground, effect: Effect, p: np.ndarray) -> Parts:
    stage, n = _stage(ground, effect), ground.field.shape[1]
    slopes = [effect.linearise(path.inputs[stage], p, path.at)[2] for path in ground.pathways]
    tails = [path.tails[stage] for path in ground.pathways]
    straight = not any(term.effect.tangent for term in ground.fit.model.terms[stage:])
    if straight and all(d.ndim == 2 for d in slopes) and all(t.ndim == 2 for t in tails):
        return [_own_axis(ground, slopes, tails, axis, n) for axis in range(3)]
    total = np.zeros((3, len(p), n))
    for path, d_p in zip(ground.pathways, slopes, strict=True):
        total += path.weight * _carry(ground, path, stage, d_p, n)
    return parts_of(total)


def _own_axis(ground: Ground, slopes, tails, axis: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Parameter j acts on axis j % 3 alone, all the way to the reading."""
    weighted = zip(ground.pathways, slopes, tails, strict=True)
    rows = sum(path.weight * t[axis] * d[axis::3] for path, d, t in weighted)
    index = np.arange(axis, slopes[0].shape[0], 3)
    return index, np.broadcast_to(np.asarray(rows), (index.size, n))


def _secant(ground: Ground, effect: Effect, null: np.ndarray, j: int, size: float) -> np.ndarray:
    """(3, n): the change of the readings over `size` of parameter j, per unit of it."""
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
