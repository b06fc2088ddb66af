"""The chosen effects as one model: field -> reading (predict), its derivatives, and back (undo, invert).

n samples, P parameters in stack order. Fields are (3, n) in µT, readings (3, n) in LSB.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from barberpole.effects import ALIASES, STACK, Conditions, Effect, Param, Setup
from barberpole.errors import InputError

Array = np.ndarray


@dataclass(frozen=True)
class Term:
    """One effect in a model, with the parameters it has in this setup and their place in the vector."""

    effect: Effect
    params: tuple[Param, ...]
    at: slice


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

    @property
    def null(self) -> Array:
        return np.array([p.null for p in self.params])

    @property
    def first(self) -> Array:
        return np.array([p.first for p in self.params])

    def bounds(self) -> tuple[Array, Array]:
        return np.array([p.lower for p in self.params]), np.array([p.upper for p in self.params])

    def states(self, at: Conditions) -> list[tuple[float, Conditions]]:
        """The magnetisations to evaluate, with their weights: a demodulated reading is the mean of SET and RESET."""
        state = np.asarray(at.state, float)
        if self.unflipped:
            return [(1.0, replace(at, state=np.where(state == 0, 1.0, state)))]
        if not self.flips or np.all(state != 0):
            return [(1.0, at)]
        return [(0.5, replace(at, state=np.where(state == 0, s, state))) for s in (1.0, -1.0)]

    def predict(self, field_ut: Array, p: Sequence[float], at: Conditions) -> Array:
        """Readings (3, n) in LSB for a field (3, n) in µT."""
        total = 0.0
        for weight, one in self.states(at):
            xyz = field_ut
            for term in self.terms:
                xyz = term.effect.forward(xyz, p[term.at], one)
            total = total + weight * np.asarray(xyz)
        return np.asarray(total)

    def linearise(self, field_ut: Array, p: Array, at: Conditions, field_too: bool = False) -> tuple[Array, Array, Array | None]:
        """Readings (3, n), d reading / d p (3, P, n) and, if asked, d reading / d field (3, 3, n)."""
        y, d_p, d_b = np.zeros(1), np.zeros(1), None
        for weight, one in self.states(at):
            y_s, p_s, b_s = self._linearise(field_ut, p, one, field_too)
            y, d_p = y + weight * y_s, d_p + weight * p_s
            if b_s is not None:
                d_b = weight * b_s if d_b is None else d_b + weight * b_s
        return y, d_p, d_b

    def _linearise(self, field_ut, p, at, field_too):
        n = field_ut.shape[1]
        offset = 3 if field_too else 0
        chain = np.zeros((3, offset + len(p), n))  # derivative of the current stage by field and parameters so far
        if field_too:
            chain[:, :3] = np.eye(3)[:, :, None]
        xyz = field_ut
        for term in self.terms:
            d_in, d_p = term.effect.derivatives(xyz, p[term.at], at)
            done = offset + term.at.start
            if d_in is not None and done:
                chain[:, :done] = push(d_in, chain[:, :done])
            chain[:, done : done + d_p.shape[1]] = d_p
            xyz = np.asarray(term.effect.forward(xyz, p[term.at], at))
        return xyz, chain[:, offset:], chain[:, :3] if field_too else None

    def undo(self, xyz, p: Sequence[float], at: Conditions):
        """Field of one magnetisation's readings (state +1 or -1), by each effect's own inverse, last to first.

        Plain arithmetic throughout: runs on arrays and on the firmware generator's symbols.
        """
        for term in reversed(self.terms):
            undo = term.effect.undo
            if undo is None:
                raise InputError(f"effect {term.effect.name} must have an undo to be compensated; it gives forward only")
            xyz = undo(xyz, p[term.at], at)
        return xyz

    def undo_pair(self, set_xyz, reset_xyz, p: Sequence[float], at: Conditions):
        """Field from a SET and a RESET reading (both with the sign of SET): each undone in its own state, averaged."""
        if not self.flips:
            mean = tuple(0.5 * (a + b) for a, b in zip(set_xyz, reset_xyz, strict=True))
            return self.undo(mean, p, replace(at, state=0.0))
        after_set = self.undo(set_xyz, p, replace(at, state=1.0))
        after_reset = self.undo(reset_xyz, p, replace(at, state=-1.0))
        return tuple(0.5 * (a + b) for a, b in zip(after_set, after_reset, strict=True))

    def invert(self, reading: Array, p: Array, at: Conditions, steps: int = 12, tolerance: float = 1e-12) -> Array:
        """Field (3, n) behind the readings, by Newton on `predict`: works for every state and every effect."""
        field = self._linear_guess(reading, p, at)
        for _ in range(steps):
            y, _, slope = self.linearise(field, p, at, field_too=True)
            step = solve3(slope, reading - y)
            field = field + step
            if np.max(np.abs(step), initial=0.0) <= tolerance * max(np.max(np.abs(field), initial=0.0), 1e-300):
                break
        return field

    def _linear_guess(self, reading, p, at):
        zero = np.zeros((3, 1))
        one = at.take(slice(0, 1))
        y, _, slope = self.linearise(zero, p, one, field_too=True)
        return np.linalg.solve(slope[:, :, 0], reading - y)


def push(d_in: Array, chain: Array) -> Array:
    """Carry derivatives (3, K, n) through a stage with d out / d in of shape (3, n) (diagonal) or (3, 3, n)."""
    if d_in.ndim == 2:
        return d_in[:, None, :] * chain
    return np.einsum("ijn,jkn->ikn", d_in, chain)


def solve3(matrix: Array, right: Array) -> Array:
    """x of matrix x = right for n systems at once: (3, 3, n), (3, n) -> (3, n). Cramer's rule, no copies per sample."""
    a, b, c = matrix[:, 0], matrix[:, 1], matrix[:, 2]
    bc, ca, ab = np.cross(b, c, axis=0), np.cross(c, a, axis=0), np.cross(a, b, axis=0)
    det = np.sum(a * bc, axis=0)
    return np.stack([np.sum(right * v, axis=0) for v in (bc, ca, ab)]) / det


def find_effect(name: str, extra: Sequence[Effect] = ()) -> Effect:
    """The effect of that name or alias. Raises InputError with the known names."""
    known = {e.name: e for e in (*STACK, *extra)}
    wanted = ALIASES.get(name, name)
    if wanted not in known:
        raise InputError(f"effect must be one of {', '.join(known)}; got {name!r}")
    return known[wanted]


def compose(names: Sequence[str], setups: dict[str, Setup] | Setup, extra: Sequence[Effect] = ()) -> Model:
    """The model of these effects, in physical order whatever the order of the names."""
    order = [e.name for e in (*STACK, *extra)]
    chosen = {find_effect(name, extra).name: find_effect(name, extra) for name in names}
    terms, start = [], 0
    for effect in sorted(chosen.values(), key=lambda e: order.index(e.name)):
        setup = setups if isinstance(setups, Setup) else setups[effect.name]
        params = effect.params(setup)
        terms.append(Term(effect, params, slice(start, start + len(params))))
        start += len(params)
    unflipped = any(not isinstance(setups, Setup) and s.settings.get("form") == "unflipped" for s in _values(setups))
    return Model(tuple(terms), unflipped)


def _values(setups):
    return () if isinstance(setups, Setup) else setups.values()
