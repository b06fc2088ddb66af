"""A user's effect on trial: run on a few samples, held against its contract, and completed by what it leaves out."""

import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from barberpole.effects import Conditions, Effect, Setup
from barberpole.effects.arithmetic import Bare
from barberpole.effects.derived import by_complex_step, by_differences, carrier, inverse, slopes
from barberpole.effects.effect import Array, Param
from barberpole.errors import InputError, must

SAMPLES = 48
COLUMNS = ("t_s", "temp_c", "load_a", "supply_v", "i_ma")
SETUP = Setup(lsb_per_ut=3.0, span_ut=50.0, duration_s=0.5, interval_s=0.01)
AGREE = 1e-4  # of the largest: two ways to a derivative that differ by more are not the same derivative
ABSENT = 1e-12  # of the field: rounding that an effect at its null may leave
UNDONE = 1e-6  # of the effect's own size, by the user's undo
NO_CODE = "it has no undo of its own"
NOT_PLAIN = "its undo needs more than + - * / and sqrt"


@dataclass(frozen=True)
class Trial:
    """A plugin being tried: its parameters with their typical values p (K,), a field (3, n), all conditions known."""

    path: Path
    effect: Effect
    params: tuple[Param, ...]
    field: Array
    at: Conditions

    @property
    def null(self) -> Array:
        return np.array([p.null for p in self.params])

    @property
    def typical(self) -> Array:
        return np.array([p.null if p.inner else p.null + (p.typical or 0.0) for p in self.params])

    def where(self, function: Callable) -> str:
        """File and line of a function of the plugin."""
        return f"{self.path}, line {function.__code__.co_firstlineno}"

    def fail(self, be: str, got: object, function: Callable | None = None) -> InputError:
        """The sentence for a function that is not what it must be."""
        function = function or self.effect.forward
        return InputError(must(function.__name__, be, got, self.where(function)))


def begin(path: Path, effect: Effect) -> Trial:
    """Parameters, samples and conditions to try the effect with."""
    try:
        params = tuple(effect.params(SETUP))
    except Exception as error:
        raise InputError(must("params", "a function that runs", said(error), line_of(path, error))) from error
    where = f"{path}, line {effect.params.__code__.co_firstlineno}"
    for p in params:
        if not isinstance(p, Param):
            raise InputError(must("params", "a tuple of Param", repr(p), where))
        if not p.typical or not p.lower <= p.null <= p.upper:
            raise InputError(must(f"parameter {p.name}", "one with a typical size and null within bounds", p, where))
    if len({p.name for p in params}) < len(params):
        raise InputError(must("params", "of different names", [p.name for p in params], where))
    return Trial(path, effect, params, _samples(), _conditions(effect))


def _samples() -> Array:
    """A field (3, n) in µT that turns, and turns back a little now and then."""
    phase = 0.25 * np.arange(SAMPLES) + np.array([[0.3], [1.9], [4.0]])
    return 40.0 * np.cos(phase) + np.random.default_rng(0).normal(size=(3, SAMPLES))


def _conditions(effect: Effect) -> Conditions:
    n, rng = SAMPLES, np.random.default_rng(1)
    columns: dict[str, Any] = {
        "t_s": np.cumsum(rng.uniform(0.005, 0.015, n)),
        "temp_c": rng.uniform(15.0, 35.0, n),
        "load_a": rng.uniform(0.0, 10.0, n),
        "supply_v": rng.uniform(4.9, 5.1, n),
        "i_ma": rng.uniform(-5.0, 5.0, (3, n)),
    }
    state = np.where(np.arange(n) % 2, -1.0, 1.0) if effect.flips else np.ones(n)
    return Conditions(state=state, **{name: columns[name] for name in effect.requires if name in columns})


def check(trial: Trial) -> None:
    """Raise InputError for the first way in which `forward` is not what it must be."""
    for name in trial.effect.requires:
        if name not in COLUMNS:
            raise InputError(must("REQUIRES", f"some of {', '.join(COLUMNS)}", repr(name), trial.path))
    out = _run(trial, trial.null)
    if out.shape != trial.field.shape:
        raise trial.fail("a function of three components in and out", f"shape {out.shape} from {trial.field.shape}")
    change = float(np.max(np.abs(out - trial.field)))
    if not change <= ABSENT * np.max(np.abs(trial.field)):
        raise trial.fail("the identity while all parameters are at null", f"a change of {change:.3g}")
    out = _run(trial, trial.typical)
    if not np.all(np.isfinite(out)):
        bad = np.count_nonzero(~np.isfinite(out).all(axis=0))
        raise trial.fail("finite at typical parameters", f"NaN or infinity in {bad} of {SAMPLES} samples")
    if not np.array_equal(trial.field, _samples()):
        raise trial.fail("a function that leaves xyz as it was", "xyz changed in place")
    _check_flags(trial, out)
    if trial.effect.undo:
        _check_undo(trial, out)


def _run(trial: Trial, p: Array, field: Array | None = None, at: Conditions | None = None) -> Array:
    try:
        out = trial.effect.forward(trial.field if field is None else field, p, at or trial.at)
        return np.asarray(np.broadcast_arrays(*out) if isinstance(out, (tuple, list)) else out, float)
    except Exception as error:
        be = "a function of (xyz, p, at) that runs with the columns in REQUIRES"
        raise InputError(must("forward", be, said(error), line_of(trial.path, error))) from error


def _check_flags(trial: Trial, out: Array) -> None:
    moved = trial.field.copy()
    moved[:, SAMPLES // 2] += 1.0
    others = np.delete(_run(trial, trial.typical, moved) - out, SAMPLES // 2, axis=1)
    if np.any(others) and not trial.effect.memory:
        raise trial.fail("without memory unless MEMORY = True", "samples that depend on other samples")
    if not trial.effect.flips and np.any(_run(trial, trial.typical, None, _turned(trial.at)) != out):
        raise trial.fail("the same after SET and RESET unless FLIPS = True", "outputs that differ with at.state")


def _turned(at: Conditions) -> Conditions:
    return replace(at, state=-np.asarray(at.state))


def _check_undo(trial: Trial, out: Array) -> None:
    undo: Any = trial.effect.undo
    try:
        back = np.asarray(undo(tuple(out), trial.typical, trial.at), float)
    except Exception as error:
        raise InputError(must("undo", "a function that runs", said(error), line_of(trial.path, error))) from error
    worst = float(np.max(np.abs(back - trial.field))) if back.shape == trial.field.shape else np.nan
    if not worst <= UNDONE * np.max(np.abs(out - trial.field)) + ABSENT * np.max(np.abs(trial.field)):
        raise trial.fail("the inverse of forward", f"a field {worst:.3g} off", undo)


def complete(trial: Trial) -> Effect:
    """The effect with derivatives and undo, and notes on what they cost."""
    effect, notes = trial.effect, []
    derive = by_complex_step if _takes_complex(trial) else by_differences
    cost = 1 if derive is by_complex_step else 2
    jacobian = slopes(effect.forward, _sizes(trial), effect.memory, derive)
    count = cost * (len(trial.params) + (0 if effect.memory else 3))
    notes.append(f"derivatives cost {count} more evaluations of forward")
    if derive is by_differences:
        notes.append("forward does not take complex numbers, so that derivatives are differences, good to about 1e-9")
    off_board = _off_board(trial)
    if effect.undo is None:
        notes.append("no undo: fields are found by iteration, several times slower, and it cannot go to the board")
    elif off_board:
        notes.append(f"it cannot go to the board: {off_board}")
    return replace(
        effect,
        jacobian=jacobian,
        tangent=carrier(effect.forward, derive) if effect.memory else None,
        undo=effect.undo or inverse(effect.forward, jacobian, effect.memory),
        off_board=off_board,
        notes=tuple(notes),
    )


def _sizes(trial: Trial) -> Array:
    return np.array([abs(p.typical or 1.0) for p in trial.params])


def _takes_complex(trial: Trial) -> bool:
    """Whether the complex step gives what differences give: abs, float and comparisons on the way can spoil it."""
    forward, sizes, memory = trial.effect.forward, _sizes(trial), trial.effect.memory
    plain = slopes(forward, sizes, memory, by_differences)(trial.field, trial.typical, trial.at)
    try:
        steps = slopes(forward, sizes, memory, by_complex_step)(trial.field, trial.typical, trial.at)
    except Exception:  # noqa: BLE001 - whatever forward raises on complex numbers, differences serve instead
        return False
    return all(_agree(np.asarray(a), b) for a, b in zip(steps, plain, strict=True) if b is not None)


def _agree(one: Array, other: Array) -> bool:
    """Column by column: their sizes may differ by orders."""
    largest = np.max(np.abs(other), axis=(0, 2), initial=0.0)
    return bool(np.all(np.max(np.abs(one - other), axis=(0, 2), initial=0.0) <= AGREE * largest))


def _off_board(trial: Trial) -> str:
    undo, known = trial.effect.undo, {"t_s", "load_a", "supply_v", "i_ma"} & set(trial.effect.requires)
    if undo is None:
        return NO_CODE
    if trial.effect.memory or known:
        return f"its undo needs {'earlier samples' if trial.effect.memory else ', '.join(sorted(known))}"
    try:
        undo((Bare(10.0), Bare(-20.0), Bare(30.0)), [float(v) for v in trial.typical], _symbolic(trial))
    except Exception:  # noqa: BLE001 - whatever stops it, the generator would be stopped as well
        return NOT_PLAIN
    return ""


def _symbolic(trial: Trial) -> Conditions:
    temp_c = Bare(25.0) if "temp_c" in trial.effect.requires else None
    return replace(trial.at, state=1.0, temp_c=temp_c)


def said(error: BaseException) -> str:
    """An exception as people read it."""
    return f"{type(error).__name__}: {error}"


def line_of(path: Path, error: BaseException) -> str:
    """The plugin's file and the last line of it that the exception came through."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    return f"{path}, line {lines[-1]}" if lines else str(path)
