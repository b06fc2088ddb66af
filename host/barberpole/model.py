"""The chosen effects as one model: field -> reading (predict), its derivatives, and back (undo, invert).

n samples, P parameters in stack order. Fields are (3, n) in µT, readings (3, n) in LSB.
A demodulated reading is the mean of what SET and RESET would report: the stages before the first effect that tells
the two apart (the `head`) are run once, the `rest` once for each.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from barberpole.chain import UNIT, add_columns, full, solve3, sum_slopes, through
from barberpole.effects import Conditions, Effect, Param, Setup, find_effect, in_order
from barberpole.errors import InputError, must

Array = np.ndarray
Numbers = Any  # the parameter vector (P,)
NEWTON_STEPS = 12
CONVERGED = 1e-6  # relative step after which the next, being quadratic, would be below rounding


@dataclass(frozen=True)
class Term:
    """One effect in a model, with the parameters it has in this setup and their place in the vector."""

    effect: Effect
    params: tuple[Param, ...]
    at: slice


class Stage(NamedTuple):
    """One term at work: what went in and its slopes."""

    term: Term
    xyz: Array
    d_in: Array | None
    d_p: Array


@dataclass(frozen=True)
class Model:
    """Effects in physical order, composed. `unflipped`: readings of unknown state are taken as of one magnetisation."""

    terms: tuple[Term, ...]
    unflipped: bool = False

    @cached_property
    def params(self) -> tuple[Param, ...]:
        return tuple(p for term in self.terms for p in term.params)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """`effect.parameter` of each entry of the parameter vector."""
        return tuple(f"{term.effect.name}.{p.name}" for term in self.terms for p in term.params)

    @cached_property
    def effects(self) -> tuple[str, ...]:
        return tuple(term.effect.name for term in self.terms)

    @cached_property
    def flips(self) -> bool:
        """Whether any effect tells SET from RESET."""
        return any(term.effect.flips for term in self.terms)

    @cached_property
    def memory(self) -> bool:
        """Whether any effect needs whole time series, which must then not be cut into pieces."""
        return any(term.effect.memory for term in self.terms)

    @cached_property
    def loss(self) -> str | None:
        """How residuals are to be weighed; None: least squares."""
        return next((term.effect.loss for term in self.terms if term.effect.loss), None)

    @cached_property
    def still(self) -> "Model":
        """The same, with the same parameter vector, as if the field of other samples did not matter."""
        return replace(self, terms=tuple(t for t in self.terms if t.effect.tangent is None))

    @cached_property
    def head(self) -> tuple[Term, ...]:
        """The terms before the first that tells SET from RESET; none if a later one mixes samples."""
        first = next((i for i, t in enumerate(self.terms) if t.effect.flips), len(self.terms))
        return () if any(t.effect.tangent for t in self.terms[first:]) else self.terms[:first]

    @cached_property
    def rest(self) -> tuple[Term, ...]:
        return self.terms[len(self.head) :]

    @cached_property
    def null(self) -> Array:
        return np.array([p.null for p in self.params])

    @cached_property
    def first(self) -> Array:
        return np.array([p.first for p in self.params])

    @cached_property
    def _bounds(self) -> tuple[Array, Array]:
        return np.array([p.lower for p in self.params]), np.array([p.upper for p in self.params])

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper, (P,) each."""
        return self._bounds

    def states(self, at: Conditions) -> list[tuple[float, Conditions]]:
        """The magnetisations to evaluate, with their weights: a demodulated reading is the mean of SET and RESET."""
        state = np.asarray(at.state, float)
        if np.all(state != 0) or not self.rest:
            return [(1.0, at)]
        signs = ((1.0, 1.0),) if self.unflipped else ((0.5, 1.0), (0.5, -1.0))
        if np.any(state != 0):
            return [(weight, replace(at, state=np.where(state == 0, sign, state))) for weight, sign in signs]
        return [(weight, replace(at, state=sign)) for weight, sign in signs]

    def predict(self, field_ut: Array, p: Numbers, at: Conditions) -> Array:
        """Readings (3, n) in LSB for a field (3, n) in µT."""
        field_ut = _run(self.head, field_ut, p, at)
        return np.asarray(sum(weight * _run(self.rest, field_ut, p, one) for weight, one in self.states(at)))

    def linearise(
        self, field_ut: Array, p: Numbers, at: Conditions, field_too: bool = False
    ) -> tuple[Array, Array, Array | None]:
        """Readings (3, n), d reading / d p (3, P, n) and, if asked, d reading / d field (3, 3, n).

        The last is that by the field of the same sample, other samples' fields held.
        """
        columns = np.zeros((3, len(p), field_ut.shape[1]))
        head, field_ut = _follow(self.head, field_ut, p, at)
        y, slope = self._rest_slope(field_ut, p, at, columns)
        slope = _pull(head, slope, columns, at, p, field_too)
        return y, columns, full(slope, y.shape[1]) if field_too else None

    def slope(self, field_ut: Array, p: Numbers, at: Conditions) -> Array:
        """d reading / d field (3, 3, n) by the field of the same sample, other samples' fields held."""
        head, inner = _follow(self.head, field_ut, p, at)
        tail = _pull(head, self._rest_slope(inner, p, at)[1], None, at, p, True)
        return full(tail, field_ut.shape[1])

    def _rest_slope(self, field_ut, p, at, columns=None) -> tuple[Array, Array]:
        """Readings and d reading / d field of the stages after the head; the parameters' columns are added up."""
        y: Array = np.zeros(np.shape(field_ut))
        slope: Array = np.zeros((3, 1))
        for weight, one in self.states(at):
            stages, out = _follow(self.rest, field_ut, p, one)
            y += weight * out
            slope = sum_slopes(slope, _pull(stages, weight * UNIT, columns, one, p, True))
        return y, slope

    def undo(self, xyz, p: Numbers, at: Conditions):
        """Field of one magnetisation's readings (state +1 or -1), by each effect's own inverse, last to first.

        Plain arithmetic throughout: runs on arrays and on the firmware generator's symbols. The field of the offset
        coils, `at.coil_ut`, is not part of the result.
        """
        return _undo(self.terms, xyz, p, at)

    def undo_pair(self, set_xyz, reset_xyz, p: Numbers, at: Conditions):
        """Field from a SET and a RESET reading (both with the sign of SET): each undone in its own state, averaged."""
        if not self.flips:
            mean = tuple(0.5 * (a + b) for a, b in zip(set_xyz, reset_xyz, strict=True))
            return self.undo(mean, p, replace(at, state=0.0))
        after_set = _undo(self.rest, set_xyz, p, replace(at, state=1.0))
        after_reset = _undo(self.rest, reset_xyz, p, replace(at, state=-1.0))
        mean = tuple(0.5 * (a + b) for a, b in zip(after_set, after_reset, strict=True))
        return _undo(self.head, mean, p, replace(at, state=0.0))

    def invert(self, reading: Array, p: Numbers, at: Conditions) -> Array:
        """Field (3, n) behind the readings, for every state and every effect; NaN where none can be.

        The readings of one magnetisation are undone stage by stage; a demodulated reading takes Newton's method on
        the stages that tell SET from RESET.
        """
        with np.errstate(all="ignore"):
            states = self.states(at)
            found = np.asarray(sum(w * np.asarray(_undo(self.rest, reading, p, one)) for w, one in states))
            if len(states) > 1:
                found = self._newton(found, reading, p, at)
            return np.asarray(_undo(self.head, found, p, at))

    def _newton(self, found, reading, p, at):
        for _ in range(NEWTON_STEPS):
            y, slope = self._rest_slope(found, p, at)
            step = solve3(full(slope, y.shape[1]), reading - y)
            found = found + step
            if not np.nanmax(np.abs(step), initial=0.0) > CONVERGED * np.nanmax(np.abs(found), initial=0.0):
                break
        return found


def _run(terms, xyz, p, at):
    for term in terms:
        xyz = np.asarray(term.effect.forward(xyz, p[term.at], at))
    return xyz


def _follow(terms, xyz, p, at) -> tuple[list[Stage], Array]:
    """The stages that a field goes through, and what comes out."""
    stages = []
    for term in terms:
        out, d_in, d_p = term.effect.linearise(xyz, p[term.at], at)
        stages.append(Stage(term, xyz, d_in, d_p))
        xyz = out
    return stages, np.asarray(xyz)


def _pull(stages: list[Stage], tail: Array, columns: Array | None, at, p, slope_too: bool) -> Array:
    """Add each parameter's column to `columns` (3, P, n), from d reading / d out of the last stage backwards.

    Returns d reading / d in of the first stage, if asked.
    """
    for i in range(len(stages) - 1, -1, -1):
        term, xyz, d_in, d_p = stages[i]
        if columns is not None:
            add_columns(columns[:, term.at], tail, d_p)
            if term.effect.tangent and term.at.start:
                # what comes before reaches the reading through other samples too: bring it here, then carry it on
                before = np.zeros((3, term.at.start, xyz.shape[1]))
                _pull(stages[:i], UNIT, before, at, p, False)
                add_columns(columns[:, : term.at.start], tail, term.effect.tangent(xyz, p[term.at], at, before))
                columns = None
        if i or slope_too:
            tail = through(tail, d_in)
    return tail


def _undo(terms, xyz, p, at):
    for term in reversed(terms):
        effect = term.effect
        if effect.undo is None:
            raise InputError(f"effect {effect.name} must have an undo to be compensated; it gives forward only")
        if effect.off_board and not isinstance(xyz[0], (np.ndarray, float, int)):
            got = f"{effect.name}, and {effect.off_board}"
            raise InputError(must("a model for the board", "of effects that it can undo", got))
        xyz = effect.undo(xyz, p[term.at], at)
    return xyz


def _require_known(effect: Effect, setup: Setup) -> None:
    """Raise InputError for a setting that the effect does not have: a slip of the pen would pass for the default."""
    if effect.settings is None:
        return
    known = (*effect.settings, *(("form",) if effect.flips else ()))
    for key in setup.settings:
        if key not in known:
            wanted = f"made of {effect.name}'s own ({', '.join(known) or 'it has none'})"
            raise InputError(must("the model file's settings", wanted, f"{effect.name}.{key}"))


def compose(names: Sequence[str], setups: dict[str, Setup] | Setup, extra: Sequence[Effect] = ()) -> Model:
    """The model of these effects, in physical order whatever the order of the names."""
    order = {effect.name: place for place, effect in enumerate(in_order(extra))}
    chosen = {effect.name: effect for effect in (find_effect(name, extra) for name in names)}
    terms, start = [], 0
    for effect in sorted(chosen.values(), key=lambda effect: order[effect.name]):
        setup = setups if isinstance(setups, Setup) else setups[effect.name]
        _require_known(effect, setup)
        params = effect.params(setup)
        terms.append(Term(effect, params, slice(start, start + len(params))))
        start += len(params)
    every = (setups,) if isinstance(setups, Setup) else setups.values()
    return Model(tuple(terms), any(s.settings.get("form") == "unflipped" for s in every))
