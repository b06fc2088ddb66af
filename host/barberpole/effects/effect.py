"""What an effect is: one piece of physics, from which simulation, fit, compensation and diagnosis follow.

Symbols used in every effect file
    xyz     three components, each an array (n,) or a symbol of the firmware generator
    p       the effect's parameters, a flat sequence in the order of its `params`
    at      the `Conditions` under which the readings were taken
Effects before `scale` in the stack work on µT, `scale` and those after it on LSB.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

Array = np.ndarray
Components = Any  # three components: arrays (n,) or symbols


@dataclass(frozen=True)
class Param:
    """One parameter. At `null` the effect is exactly absent; `start` is where a fit begins.

    `start` differs from `null` only where the derivative at the null explains nothing (cross_field of
    demodulated readings is even in k). `typical` is the size a real sensor shows, in the same unit: diagnosis
    takes the secant to it where the derivative is no guide.
    """

    name: str
    unit: str
    null: float = 0.0
    lower: float = -np.inf
    upper: float = np.inf
    start: float | None = None
    typical: float | None = None

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
    t0_c            reference temperature
    raw_polarity    the RESET readings came with reversed sign, so that the bridge's own offset alternates here
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
    """What an effect may adapt its list of parameters to, known before any fit."""

    settings: dict[str, Any] = field(default_factory=dict)
    reference: str = "vector"  # or "magnitude", "constant"
    flipping: str = "none"  # or "corrected", "raw": SET and RESET readings in one log, and with which sign
    lsb_per_ut: float = 1.0  # rough gain, for typical sizes only
    anisotropy_ut: tuple[float, float, float] = (800.0, 800.0, 800.0)
    span_ut: float = 50.0  # largest field component seen


Jacobian = tuple[Array | None, Array]


@dataclass(frozen=True)
class Effect:
    """One physical effect.

    params      Setup -> its parameters
    forward     (xyz, p, at) -> xyz: from the true field towards the reading
    undo        (xyz, p, at) -> xyz: the exact inverse for one magnetisation, in + - * / and np.sqrt only, so that
                it runs on arrays and on the generator's symbols alike; parameters are plain numbers
    jacobian    (xyz, p, at) -> (d out / d in, d out / d p): shapes (3, n) where diagonal, else (3, 3, n), or None for
                the identity; and (3, len(p), n). Without one the complex step is used
    requires    log columns without which it cannot be judged
    flips       it tells SET from RESET, so a demodulated reading is the mean of two evaluations
    """

    name: str
    equation: str
    source: str
    params: Callable[[Setup], tuple[Param, ...]]
    forward: Callable[[Components, Sequence[float], Conditions], Components]
    undo: Callable[[Components, Sequence[float], Conditions], Components] | None = None
    jacobian: Callable[[Components, Sequence[float], Conditions], Jacobian] | None = None
    requires: tuple[str, ...] = ()
    flips: bool = False

    def derivatives(self, xyz: Array, p: Array, at: Conditions) -> Jacobian:
        """`jacobian`, or the complex step where the effect gives none."""
        return (self.jacobian or self.complex_step)(xyz, p, at)

    def complex_step(self, xyz: Array, p: Array, at: Conditions, h: float = 1e-30) -> Jacobian:
        """Both derivatives of `forward` by the complex step: exact to rounding, at len(p) + 3 evaluations."""
        n = np.shape(xyz)[1]
        d_in, d_p = np.empty((3, 3, n)), np.empty((3, len(p), n))
        for j in range(3):
            moved = np.asarray(xyz, complex)
            moved[j] += 1j * h
            d_in[:, j] = np.broadcast_to(np.asarray(self.forward(moved, p, at)), (3, n)).imag / h
        for j in range(len(p)):
            moved = np.asarray(p, complex)
            moved[j] += 1j * h
            d_p[:, j] = np.broadcast_to(np.asarray(self.forward(xyz, moved, at)), (3, n)).imag / h
        return d_in, d_p


def per_axis(unit: str, null: float = 0.0, prefix: str = "", **limits: Any) -> tuple[Param, ...]:
    """Three parameters of one kind, named for the axes."""
    return tuple(Param(f"{prefix}{axis}", unit, null, **limits) for axis in "xyz")


def diagonal(values: Array) -> Array:
    """(3, n) -> (3, 3, n) with the values on the diagonal: parameter j acts on axis j alone."""
    out = np.zeros((3, *np.shape(values)))
    for axis in range(3):
        out[axis, axis] = values[axis]
    return out
