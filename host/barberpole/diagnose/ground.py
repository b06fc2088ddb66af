"""A fitted model traversed once: where the columns of absent effects are evaluated and carried from."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from barberpole.chain import UNIT, full, solve3, sum_slopes, through
from barberpole.diagnose.table import Parts
from barberpole.effects import Conditions, Effect, in_order
from barberpole.fit.fit import Fit


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

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the residual channels."""
        return ("x", "y", "z") if self.normal is None else ("norm",)

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
