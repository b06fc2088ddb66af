"""What each absent effect would add to the readings: its derivatives at the null, carried through the fitted model.

Where the derivative at the null explains nothing (cross_field of demodulated readings is even in k) the secant to the
effect's typical size stands in. Effects with inner parameters bring several forms.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from barberpole.chain import add_columns
from barberpole.diagnose.ground import Ground, Pathway
from barberpole.diagnose.table import Parts, parts_of
from barberpole.effects import Effect, Setup
from barberpole.effects.effect import Shape, spread

FLAT = 1e-3  # a derivative this small beside the others of its effect explains nothing


@dataclass(frozen=True)
class Candidate:
    """One form of an absent effect: its columns by channel in LSB per parameter unit, and the `names` of their
    parameters.

    held: other parameters of the effect, which this form leaves alone.
    raw_rms: what the effect does to the readings at its typical size, LSB.
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
    held: tuple[str, ...] = ()
    shape: Shape = field(default_factory=Shape)
    raw_rms: float = 0.0


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
        tuple(q.name for q, w in zip(params, wanted, strict=True) if not w and not q.inner),
        shape,
        _raw_rms(columns, typical[wanted]),
    )


def again(form: Candidate, ground: Ground) -> Candidate:
    """The same form in another recording."""
    return candidate(ground, form.effect, form.shape, form.setup.settings, form.setup)


def _raw_rms(parts: Parts, typical: np.ndarray) -> float:
    """Of what all parameters together, each at its typical size, add to the readings."""
    power = [float(np.mean((np.abs(typical[index]) @ rows) ** 2)) if index.size else 0.0 for index, rows in parts]
    return float(np.sqrt(np.mean(power)))


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
