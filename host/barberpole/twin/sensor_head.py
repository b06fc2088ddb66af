"""The three bridges with their straps and offset coils: from the fields of the world to voltages.

    v_i = s_i (S_i f_i (1 + s_i d_i) + b_i) + o_i

f is `physics.film_field` of the field on the die: the ambient field through soft iron and the tilted axes, plus the
offset coils. A coil acts on its own die; of its neighbours' films it reaches a few per cent, along the sensitive axis
(thesis 6.2.1: it does not reach their easy axis in a way that could be used).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import fields, replace

import numpy as np

from barberpole.board import Board
from barberpole.strap import strap_peak_a
from barberpole.twin.ambient import Stepped
from barberpole.twin.physics import film_field, turns_over
from barberpole.twin.world import IDENTITY, T0_C, World

AXES = "xyz"
INPUTS = 8
SUPPLY_LOW = 0.6
STEP_UT = (1.8, -1.2, 2.4)  # ambient_step: a car passing
PROGRAMS = ("ambient", "temperature")  # fields of World that are not numbers
KEPT_STATES = 512  # voltages remembered while the surroundings stand still
NEVER_SEEN = (math.inf, -math.inf)


class SensorHead:
    """State of the sensor: magnetisation per die, coil currents, and the surroundings that act on it."""

    def __init__(self, board: Board, world: World, magnetisation: Sequence[int], faults: frozenset[str] = frozenset()):
        self.board, self.world, self.faults = board, world, faults
        self.magnetisation = list(magnetisation)
        self.current_ma = [0.0, 0.0, 0.0]
        self._easy = tuple(AXES.index(axis) for axis in board.sensor.easy_axis)
        self._mount = mounting(world)
        self.coil_ut_per_ma = coil_matrix(board, world, faults)
        channels = board.adc.channels
        self._channels = [(getattr(channels, name), getattr(channels, f"coil_{name}")) for name in AXES]
        self._nominal_v_per_ut = 1e-3 * board.sensor.sensitivity_mv_per_v_per_ut * board.sensor.bridge_v
        self.still_s = NEVER_SEEN
        self._field_ut: list[float] = [0.0, 0.0, 0.0]
        self.temp_c = T0_C
        self._known: dict[tuple, list[float]] = {}

    def magnetise(self, state: int) -> None:
        """A strap pulse aligns every die with `state`."""
        self.magnetisation = [state] * 3

    def drive(self, axis: int, share: float) -> None:
        """Put `share` (-1..1) of the driver's full scale across the coil of an axis."""
        if f"coil_open_{AXES[axis]}" in self.faults:
            share = 0.0
        full_ma = self.board.coils.full_scale_ma[axis]
        if f"coil_short_{AXES[axis]}" in self.faults:
            coil_ohm = self.board.sensor.offset_coil_ohm
            others_ohm = (self.board.in_series - 1) * coil_ohm
            rest_ohm = self.board.coils.series_ohm + self.board.adc.coil_shunt_ohm + others_ohm
            full_ma *= (rest_ohm + coil_ohm) / rest_ohm
        self.current_ma[axis] = share * full_ma

    def carry(self, axis: int, current_ma: float) -> None:
        """The current of a coil that is in series with another sensor's."""
        self.current_ma[axis] = current_ma

    def jump_field(self, at_s: float) -> None:
        """The ambient field steps at at_s and stays there."""
        self.world = replace(self.world, ambient=Stepped(self.world.ambient, at_s, STEP_UT))
        self.still_s = NEVER_SEEN

    @property
    def supply_v(self) -> float:
        """Voltage of the strap driver in V."""
        return self.board.flip.strap_supply_v * (SUPPLY_LOW if "supply_low" in self.faults else 1.0)

    @property
    def strap_a(self) -> float:
        """Peak of a strap pulse in A, through the capacitor that the last one has left charged."""
        return strap_peak_a(self.board) * self.supply_v / self.board.flip.strap_supply_v

    def volts(self, t_s: float) -> list[float]:
        """Voltage on every input of the converter at t_s, without noise."""
        start_s, end_s = self.still_s
        if not start_s <= t_s < end_s and t_s != start_s:
            self._look_around(t_s)
        state = (*self.magnetisation, *self.current_ma)
        known = self._known.get(state)
        if known is None:
            for die in self._turned(self._field_ut):
                self.magnetisation[die] *= -1
            known = self._inputs(self._field_ut, self.temp_c)
            if len(self._known) < KEPT_STATES:
                self._known[(*self.magnetisation, *self.current_ma)] = known
        return known

    def coming(self, times_s: Sequence[float]) -> list[list[float]]:
        """Voltages at times to come, up to the first at which a die turns over. Nothing is changed by asking."""
        found = []
        times = np.asarray(times_s)
        for field_ut, temp_c in zip(self._fields_ut(times), self.world.temp(times).tolist(), strict=True):
            if self._turned(field_ut):
                break
            found.append(self._inputs(field_ut, temp_c))
        return found

    def _fields_ut(self, times_s: np.ndarray) -> list[list[float]]:
        """Field along the axes of the dies without coils, µT, at times (n,): n of three."""
        field, mount = self.world.field(times_s), self._mount
        if mount is not None:
            field = mount[:, :1] * field[0] + mount[:, 1:2] * field[1] + mount[:, 2:] * field[2]
        return field.T.tolist()

    def _die_field_ut(self, field_ut: list[float]) -> list[float]:
        """Field along the sensitive axis of each die in µT, coils included."""
        matrix, (ix, iy, iz) = self.coil_ut_per_ma, self.current_ma
        return [field_ut[i] + matrix[i][0] * ix + matrix[i][1] * iy + matrix[i][2] * iz for i in range(3)]

    def _look_around(self, t_s: float) -> None:
        """Take field and temperature of this moment, and how long they will stay."""
        [self._field_ut] = self._fields_ut(np.array([t_s]))
        self.temp_c = float(self.world.temp(t_s)[0])
        self.still_s = (t_s, self.world.constant_until(t_s))
        self._known.clear()

    def _turned(self, field_ut: list[float]) -> list[int]:
        """The dies that a field reverses: it lies outside their astroid."""
        anisotropy_ut = self.world.anisotropy_ut
        return [
            i
            for i, across_ut in enumerate(self._die_field_ut(field_ut))
            if turns_over(across_ut, field_ut[self._easy[i]], anisotropy_ut[i], self.magnetisation[i])
        ]

    def _inputs(self, field_ut: list[float], temp_c: float) -> list[float]:
        board, channels = self.board, self.board.adc.channels
        warm = 1.0 + board.sensor.bridge_tempco_per_c * (temp_c - T0_C)
        volts = [0.0] * INPUTS
        for axis, across_ut in enumerate(self._die_field_ut(field_ut)):
            bridge, coil = self._channels[axis]
            volts[bridge] = self._bridge_v(axis, across_ut, field_ut[self._easy[axis]], temp_c)
            volts[coil] = 1e-3 * self.current_ma[axis] * board.adc.coil_shunt_ohm
        volts[channels.bridge] = board.sensor.bridge_v * warm * board.adc.bridge_divider
        volts[channels.supply] = self.supply_v * board.adc.supply_divider
        return volts

    def _bridge_v(self, axis: int, across_ut: float, along_ut: float, temp_c: float) -> float:
        """The equation above, for one die."""
        world, sensor, s = self.world, self.board.sensor, self.magnetisation[axis]
        film_v = self._gain_v_per_ut(axis, temp_c) * film_field(across_ut, along_ut, world.anisotropy_ut[axis], s)
        warm = 1.0 + sensor.bridge_tempco_per_c * (temp_c - T0_C)
        offset_v = 1e-3 * world.offset_mv_per_v[axis] * sensor.bridge_v * warm
        return s * (film_v * (1.0 + s * world.flip_asymmetry[axis]) + self._bias_v(axis, temp_c)) + offset_v

    def _gain_v_per_ut(self, axis: int, temp_c: float) -> float:
        """Today's sensitivity at zero field and this temperature."""
        world = self.world
        spread = world.gain_spread[axis] * world.gain_drift[axis]
        return self._nominal_v_per_ut * spread * (1.0 + world.sensitivity_per_c[axis] * (temp_c - T0_C))

    def _bias_v(self, axis: int, temp_c: float) -> float:
        world = self.world
        bias_ut = world.bias_ut[axis] + world.bias_drift_ut[axis] + world.bias_ut_per_c[axis] * (temp_c - T0_C)
        return bias_ut * self._nominal_v_per_ut * world.gain_spread[axis]

    def truth(self, t_s: float, noise_v: Callable[[int], float]) -> dict:
        """What is hidden, in the units of a calibration. noise_v(input) is the V rms of one conversion."""
        self.volts(t_s)
        world, adc = self.world, self.board.adc
        lsb_per_v = 1e3 * adc.lsb_per_mv
        averaged = adc.samples_per_half**0.5
        return {
            "temp_c": self.temp_c,
            "field_ut": world.field(t_s)[:, 0].tolist(),
            "scale_lsb_per_ut": [self._gain_v_per_ut(i, self.temp_c) * lsb_per_v for i in range(3)],
            "bias_lsb": [self._bias_v(i, self.temp_c) * lsb_per_v for i in range(3)],
            "offset_lsb": [1e-3 * v * self.board.sensor.bridge_v * lsb_per_v for v in world.offset_mv_per_v],
            "noise_lsb": [noise_v(getattr(adc.channels, name)) * lsb_per_v / averaged for name in AXES],
            "coil_ut_per_ma": [list(row) for row in self.coil_ut_per_ma],
            "magnetisation": list(self.magnetisation),
            "coil_ma": list(self.current_ma),
            "faults": sorted(self.faults),
            "parameters": {f.name: getattr(world, f.name) for f in fields(world) if f.name not in PROGRAMS},
        }


def mounting(world: World) -> np.ndarray | None:
    """Soft iron, then unit vectors along the tilted sensitive axes: (3, 3), or None where both are ideal."""
    rows = np.eye(3) + np.asarray(world.misalignment_rad)
    if world.soft_iron == IDENTITY and np.array_equal(rows, np.eye(3)):
        return None
    return rows / np.linalg.norm(rows, axis=1, keepdims=True) @ np.asarray(world.soft_iron)


def coil_matrix(board: Board, world: World, faults: frozenset[str]) -> list[list[float]]:
    """Field on die i in µT per mA in coil j; a shorted coil makes none."""
    nominal = board.sensor.offset_coil_ut_per_ma
    alive = [0.0 if f"coil_short_{axis}" in faults else 1.0 for axis in AXES]
    return [[nominal * world.coil_spread[j] * world.coil_coupling[i][j] * alive[j] for j in range(3)] for i in range(3)]
