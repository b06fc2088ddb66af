"""What surrounds the emulated board and what its sensor really is: the truth that a calibration has to find.

>>> World.of(board, hidden=("cross_field",), ambient=Stations.on_sphere(48, (30.0, 50.0)))  # doctest: +SKIP

Time runs in seconds from the board's power-up, so a log's t_s can be held against `field` and `temp` directly. Nothing
here is shared with barberpole.effects: each hidden effect is an amplitude of the physics in `sensor_head`.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from barberpole.board import Board
from barberpole.errors import InputError, must
from barberpole.twin.ambient import Ambient, Fixed
from barberpole.twin.temperature import Constant, Temperature

Triple = tuple[float, float, float]
Matrix = tuple[Triple, Triple, Triple]

IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
INFINITE: Triple = (math.inf, math.inf, math.inf)
T0_C = 25.0

# A board is not its data sheet: what follows is one believable specimen, the same at every power-up.
GAIN_SPREAD: Triple = (1.021, 0.984, 1.009)
COIL_SPREAD: Triple = (1.013, 0.991, 1.022)
COIL_COUPLING: Matrix = ((1.0, 0.021, -0.012), (0.018, 1.0, 0.009), (-0.014, 0.011, 1.0))
BIAS_UT: Triple = (0.42, -0.27, 0.18)
OFFSET_SIGNS: Triple = (1.0, -0.6, 0.8)

FLIP_ASYMMETRY: Triple = (0.004, -0.003, 0.005)
MISALIGNMENT_RAD: Matrix = ((0.0, 0.012, -0.008), (0.006, 0.0, 0.011), (-0.009, 0.007, 0.0))
SOFT_IRON: Matrix = ((1.012, 0.006, -0.004), (0.006, 0.991, 0.005), (-0.004, 0.005, 1.004))
FLIPPED_DRIFT_RATIO = 20.0  # flipping lowers the bridge's offset drift "by more than 20 times" (thesis 3.4.2)


@dataclass(frozen=True)
class World:
    """Ambient field, temperature, the sensor's true parameters, and how far both have moved since the factory."""

    ambient: Ambient = field(default_factory=Fixed)
    temperature: Temperature = field(default_factory=Constant)
    gain_drift: Triple = (1.0, 1.0, 1.0)
    """Today's gain over the factory's."""
    bias_drift_ut: Triple = (0.0, 0.0, 0.0)
    """µT. Today's bias minus the factory's."""
    gain_spread: Triple = GAIN_SPREAD
    """The specimen's gain over the nominal one."""
    bias_ut: Triple = BIAS_UT
    """µT. Field-like offset of each bridge."""
    offset_mv_per_v: Triple = (0.0, 0.0, 0.0)
    """mV/V. Electronic offset of each bridge, which flipping removes (thesis 3.37)."""
    coil_spread: Triple = COIL_SPREAD
    """The specimen's coil constants over the nominal ones."""
    coil_coupling: Matrix = COIL_COUPLING
    """Field of coil j on die i, as a fraction of its field on its own die."""
    anisotropy_ut: Triple = INFINITE
    """µT. H_k of each film; infinite: no cross-field effect."""
    flip_asymmetry: Triple = (0.0, 0.0, 0.0)
    """Half the relative difference of the SET and RESET gains."""
    bias_ut_per_c: Triple = (0.0, 0.0, 0.0)
    """µT/K. Drift of the field-like offset."""
    sensitivity_per_c: Triple = (0.0, 0.0, 0.0)
    """1/K. Drift of the gain."""
    misalignment_rad: Matrix = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    """rad. Tilt of axis i towards axis j (its tangent)."""
    soft_iron: Matrix = IDENTITY
    """Field at the sensor per field around the board."""
    noise: float = 1.0
    """White noise over the sensor's data sheet."""
    flicker: float = 0.0
    """1/f noise of the bridges over the sensor's data sheet (corner_hz); electronic, so flipping removes it."""

    @classmethod
    def of(cls, board: Board, hidden: tuple[str, ...] = ("cross_field",), **changes) -> "World":
        """The world of this board, with the effects named in `hidden` (or "none") at their physical size.

        `changes` are fields of World. Raises InputError on a name that is not in HIDDEN.
        """
        sensor = board.sensor
        offset = tuple(sensor.offset_mv_per_v * sign for sign in OFFSET_SIGNS)
        values: dict = {"offset_mv_per_v": offset}
        for name in hidden:
            values |= _effect(name)(board)
        return cls(**(values | changes))

    def field(self, t_s) -> np.ndarray:
        """Field around the board in µT at the times t_s (n,) from power-up: (3, n)."""
        return self.ambient.field_ut(np.atleast_1d(np.asarray(t_s, float)))

    def temp(self, t_s) -> np.ndarray:
        """Temperature in °C at the times t_s (n,): (n,)."""
        return self.temperature.temp_c(np.atleast_1d(np.asarray(t_s, float)))

    def steady(self, t_s, margin_s: float = 0.02) -> np.ndarray:
        """Which of the times t_s (n,) lie at least margin_s from any step of the field: (n,) bool."""
        t = np.atleast_1d(np.asarray(t_s, float))
        steps = np.asarray(self.ambient.steps_s(), float)
        if not steps.size:
            return np.ones(t.shape, bool)
        return np.abs(t[:, None] - steps).min(axis=1) >= margin_s

    def constant_until(self, t_s: float) -> float:
        """Time in s up to which neither field nor temperature moves from their values at t_s (t_s: they move now)."""
        return min(self.ambient.constant_until(t_s), self.temperature.constant_until(t_s))

    def drifted(self, gain_drift: Triple | None = None, bias_drift_ut: Triple | None = None) -> "World":
        """The same world after gains or biases have moved."""
        return replace(
            self,
            gain_drift=self.gain_drift if gain_drift is None else gain_drift,
            bias_drift_ut=self.bias_drift_ut if bias_drift_ut is None else bias_drift_ut,
        )


def _cross_field(board: Board) -> dict:
    return {"anisotropy_ut": tuple(board.sensor.anisotropy_field_ut)}


def _bias_temperature(board: Board) -> dict:
    """The drift (3.25) of the electronic offset, as far as flipping leaves it."""
    sensor = board.sensor
    offset_ut = sensor.offset_mv_per_v / sensor.sensitivity_mv_per_v_per_ut
    drift = offset_ut * sensor.bridge_tempco_per_c / FLIPPED_DRIFT_RATIO
    return {"bias_ut_per_c": tuple(drift * sign for sign in OFFSET_SIGNS)}


def _sensitivity_temperature(board: Board) -> dict:
    return {"sensitivity_per_c": (board.sensor.sensitivity_tempco_per_c,) * 3}


HIDDEN: dict[str, Callable[[Board], dict]] = {
    "none": lambda _: {},
    "cross_field": _cross_field,
    "flip_asymmetry": lambda _: {"flip_asymmetry": FLIP_ASYMMETRY},
    "bias_temperature": _bias_temperature,
    "sensitivity_temperature": _sensitivity_temperature,
    "misalignment": lambda _: {"misalignment_rad": MISALIGNMENT_RAD},
    "soft_iron": lambda _: {"soft_iron": SOFT_IRON},
}
"""Effects that a world can hide, with the fields of World that they set."""


def _effect(name: str) -> Callable[[Board], dict]:
    if name not in HIDDEN:
        raise InputError(must("the hidden effect", f"one of {', '.join(HIDDEN)}", repr(name)))
    return HIDDEN[name]
