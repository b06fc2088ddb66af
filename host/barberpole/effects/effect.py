"""What an effect is: one piece of physics, from which simulation, fit, compensation and diagnosis follow.

Symbols used in every effect file
    xyz     three components, each an array (n,) or a symbol of the firmware generator
    p       the effect's parameters, a flat sequence in the order of its `params`
    at      the `Conditions` under which the readings were taken
Effects before `scale` in the stack work on µT, `scale` and those after it on LSB.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import Any

import numpy as np

from barberpole.errors import InputError, must

Array = np.ndarray
Components = Any  # three components: arrays (n,) or symbols
Numbers = Any  # parameter values: any flat sequence of numbers


@dataclass(frozen=True)
class Param:
    """One parameter. At `null` the effect is exactly absent; `start` is where a fit begins.

    `start` differs from `null` only where the derivative at the null explains nothing (cross_field of
    demodulated readings is even in k). `typical` is the size a real sensor shows, in the same unit: diagnosis
    takes the secant to it where the derivative is no guide. An `inner` parameter (a width, a period) shapes the
    effect but has no size of its own: it matters only once another parameter has left its null.
    """

    name: str
    unit: str
    null: float = 0.0
    lower: float = -np.inf
    upper: float = np.inf
    start: float | None = None
    typical: float | None = None
    inner: bool = False

    @property
    def first(self) -> float:
        """Where a fit begins."""
        return self.null if self.start is None else self.start


@dataclass(frozen=True)
class Conditions:
    """What is known of each sample beside the field and the reading. None: the log does not say.

    state           (n,) +1 SET, -1 RESET, 0 demodulated: the mean of what the two would report
    t_s, temp_c     (n,) time and sensor temperature
    i_ma            (3, n) coil currents
    load_a          (n,) current of the host platform
    supply_v        (n,) supply voltage
    coil_ut         (3,) or (3, n): field of each die's own offset coil; a neighbour's easy axis does not see it
    gain            (3,): today's gain of each axis over the calibrated one, from the offset coils (thesis 6.7)
    easy_axis       which axis lies along the easy axis of the x, y and z bridge (thesis 5.3.2)
    t0_c, t0_s      reference temperature and reference time
    raw_polarity    RESET readings came with reversed sign, so that the bridge's own offset alternates here; goes with
                    parameters made under `Setup.flipping == "raw"` and with no others
    """

    state: Any = 0.0
    t_s: Array | None = None
    temp_c: Any = None
    i_ma: Array | None = None
    load_a: Array | None = None
    supply_v: Array | None = None
    coil_ut: Any = (0.0, 0.0, 0.0)
    gain: Any = (1.0, 1.0, 1.0)
    easy_axis: tuple[int, int, int] = (1, 0, 1)
    t0_c: float = 25.0
    t0_s: float = 0.0
    raw_polarity: bool = False

    def take(self, rows: slice | Array) -> "Conditions":
        """The same for a selection of samples; what is common to all samples stays as it is."""
        picked = {}
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, np.ndarray) and value.ndim and f.name not in ("gain", "easy_axis"):
                picked[f.name] = value[..., rows] if value.shape[-1] > 1 else value
        return replace(self, **picked)


@dataclass(frozen=True)
class Setup:
    """What an effect may adapt its list of parameters to, known before any fit.

    The list itself may depend on `settings`, `reference` and `flipping` only; the other figures are the rough size of
    what the log holds, for typical sizes and bounds.
    """

    settings: dict[str, Any] = field(default_factory=dict)
    reference: str = "vector"  # or "magnitude", "constant"
    flipping: str = "none"  # or "corrected", "raw": SET and RESET readings in one log, and with which sign
    lsb_per_ut: float = 1.0  # rough gain
    anisotropy_ut: tuple[float, float, float] = (800.0, 800.0, 800.0)
    span_ut: float = 50.0  # largest field component seen
    duration_s: float = 100.0
    interval_s: float = 0.01  # between two samples
    load_a: float = 10.0  # largest platform current seen
    current_ma: float = 10.0  # largest coil current seen

    def named(self, key: str, default: str, *others: str) -> str:
        """A setting that is one of a few words. An unknown word is an error of the model file."""
        return one_of(key, self.settings.get(key, default), default, *others)


def one_of(key: str, value: Any, *allowed: str) -> str:
    """`value` if it is allowed. Raises InputError otherwise."""
    if value not in allowed:
        raise InputError(must(f"setting {key}", " or ".join(repr(a) for a in allowed), repr(value)))
    return value


@dataclass(frozen=True)
class Shape:
    """One form an effect may take, for diagnosis to score while the effect is still absent.

    columns     the parameters scored together, by name; all that are not `inner` if empty
    inner       values of the inner parameters meanwhile
    secant      score the change up to this many times `typical`, not the derivative at the null (0)
    settings    what the model file must say for a fit to begin in this form
    tried       how many alternatives a search looked through to propose it
    """

    columns: tuple[str, ...] = ()
    inner: dict[str, float] = field(default_factory=dict)
    secant: float = 0.0
    settings: dict[str, Any] = field(default_factory=dict)
    tried: int = 1


Slopes = tuple[Array | None, Array]
"""d out / d in: (3, n) where diagonal, else (3, 3, n), or None for the identity; and d out / d p: (K, n) where
parameter j acts on axis j % 3 alone, else (3, K, n). The last dimension may be 1 where all samples agree."""


@dataclass(frozen=True)
class Effect:
    """One physical effect.

    params      Setup -> its parameters
    forward     (xyz, p, at) -> xyz: from the true field towards the reading
    undo        (xyz, p, at) -> xyz: the exact inverse for one magnetisation; where `compilable` in + - * / and
                np.sqrt only, so that it runs on arrays and on the generator's symbols alike. p are plain numbers
    jacobian    (xyz, p, at) -> `Slopes`
    joint       (xyz, p, at) -> forward and both slopes at once, where they share their work. With neither, the
                complex step is used
    requires    log columns without which it cannot be judged
    flips       it tells SET from RESET, so a demodulated reading is the mean of two evaluations
    memory      a sample depends on earlier ones or their conditions: it needs whole time series
    affine      a matrix and a constant, the same for every sample, unless readings came raw
    tangent     (xyz, p, at, chain (3, K, n)) -> (3, K, n): derivatives of the input carried to the output, for an
                effect whose output depends on the field of other samples
    stage       "field" or "reading": where a user's effect enters the stack
    loss        it changes how residuals are weighed, and nothing else
    off_board   why the board cannot undo it; empty where it can
    shapes      Setup -> forms it may take. None: one form, all parameters, derivative at the null
    search      (Setup, Conditions, reading (3, n), residual (3, n)) -> forms proposed by what is left of the readings
    notes       sentences on what using it costs
    settings    keys that the model file may give it; None: any (a user's effect reads what it likes)
    """

    name: str
    equation: str
    source: str
    params: Callable[[Setup], tuple[Param, ...]]
    forward: Callable[[Components, Numbers, Conditions], Components]
    undo: Callable[[Components, Numbers, Conditions], Components] | None = None
    jacobian: Callable[[Components, Numbers, Conditions], Slopes] | None = None
    requires: tuple[str, ...] = ()
    flips: bool = False
    summary: str = ""
    joint: Callable[[Components, Numbers, Conditions], tuple[Components, Array | None, Array]] | None = None
    memory: bool = False
    affine: bool = False
    tangent: Callable[[Components, Numbers, Conditions, Array], Array] | None = None
    stage: str = "field"
    loss: str | None = None
    off_board: str = ""
    shapes: Callable[[Setup], tuple[Shape, ...]] | None = None
    search: Callable[[Setup, Conditions, Array, Array], tuple[Shape, ...]] | None = None
    notes: tuple[str, ...] = ()
    settings: tuple[str, ...] | None = ()

    @property
    def compilable(self) -> bool:
        """Whether the firmware generator can trace its undo."""
        return self.undo is not None and not self.off_board

    def forms(self, setup: Setup) -> tuple[Shape, ...]:
        """The forms that need no search."""
        return self.shapes(setup) if self.shapes else (Shape(),)

    def linearise(self, xyz: Array, p: Numbers, at: Conditions) -> tuple[Array, Array | None, Array]:
        """Output (3, n) with both slopes."""
        if self.joint:
            out, d_in, d_p = self.joint(xyz, p, at)
        else:
            out, (d_in, d_p) = self.forward(xyz, p, at), self.derivatives(xyz, p, at)
        return np.asarray(out), d_in, d_p

    def derivatives(self, xyz: Array, p: Numbers, at: Conditions) -> Slopes:
        """`jacobian`, or from `joint`, or the complex step where the effect gives neither."""
        if self.joint and not self.jacobian:
            return self.joint(xyz, p, at)[1:]
        return (self.jacobian or self.complex_step)(xyz, p, at)

    def complex_step(self, xyz: Array, p: Numbers, at: Conditions, h: float = 1e-30) -> tuple[Array, Array]:
        """Both derivatives of `forward` by the complex step: exact to rounding, at len(p) + 3 evaluations."""
        field, numbers = np.asarray(xyz, complex), np.asarray(p, complex)
        d_in = [self._imaginary(field + 1j * h * np.eye(3)[:, j, None], p, at) / h for j in range(3)]
        steps = 1j * h * np.eye(len(numbers))
        d_p = [self._imaginary(xyz, numbers + step, at) / h for step in steps]
        return np.stack(d_in, axis=1), np.stack(d_p, axis=1) if d_p else np.zeros((3, 0, field.shape[1]))

    def _imaginary(self, xyz: Components, p: Numbers, at: Conditions) -> Array:
        return np.imag(np.broadcast_to(np.asarray(self.forward(xyz, p, at)), np.shape(xyz)))


@lru_cache(maxsize=256)
def per_axis(unit: str, null: float = 0.0, prefix: str = "", **limits: Any) -> tuple[Param, ...]:
    """Three parameters of one kind, named for the axes."""
    return tuple(Param(f"{prefix}{axis}", unit, null, **limits) for axis in "xyz")


def diagonal(values: Array) -> Array:
    """(3, n) -> (3, 3, n) with the values on the diagonal: parameter j acts on axis j alone."""
    return spread(np.asarray(values))


def spread(d_p: Array) -> Array:
    """(K, n), parameter j acting on axis j % 3, as (3, K, n)."""
    out = np.zeros((3, *np.shape(d_p)), np.result_type(d_p))
    for axis in range(3):
        out[axis, axis::3] = d_p[axis::3]
    return out
