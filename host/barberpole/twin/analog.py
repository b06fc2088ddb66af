"""What the converter digitises: the sensor head's voltages through its sinc3 filter, with noise.

Between events the head's voltages move slowly; a flip or a new coil current is a step. Each step is remembered until
the filter has settled, and what is not settled yet is taken off the present voltage: superposition, exact for steps.
"""

import math
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from barberpole.board import Board
from barberpole.twin.noise import Noise, NoiseLevel
from barberpole.twin.physics import sinc3_step
from barberpole.twin.sensor_head import AXES, INPUTS
from barberpole.twin.world import World

FILTER_PERIODS = 3  # length of a sinc3's impulse response
LONGEST_PERIOD_US = 4000.0  # of the converter's data rates
CONVERTER_NOISE_V = 8e-6  # ADS131M08 at gain 1 and 8 kHz, rms of one conversion (data sheet, noise table, about)


class Head(Protocol):
    """What the inputs look at."""

    def volts(self, t_s: float) -> list[float]:
        """Voltage on every input at t_s, without noise; the same list while nothing changes, or a new one."""
        ...

    def still_until(self, t_s: float) -> float:
        """Time in s before which what the voltages hang on is known not to move by itself."""
        ...


class AnalogInputs:
    """The voltages of all inputs, conversion by conversion."""

    def __init__(self, head: Head, noise: Noise):
        self.head = head
        self._noise = noise
        self._steps: list[tuple[float, list[float]]] = []

    def change(self, t_us: float, act: Callable[[], None]) -> None:
        """Do `act` to the head at t_us and remember the steps that its voltages make."""
        t_s = t_us * 1e-6
        before = self.head.volts(t_s)
        act()
        after = self.head.volts(t_s)
        if after is not before:
            self._forget(t_us, LONGEST_PERIOD_US)
            self._steps.append((t_us, [b - a for a, b in zip(before, after, strict=True)]))

    def ahead(self, ends_us: Sequence[float], period_us: float) -> np.ndarray:
        """Volts (n, INPUTS) of the conversions that end then, up to the first that cannot be told before its time."""
        count = len(ends_us)
        while count and not (t_s := self._middle_s(ends_us[count - 1], period_us)) < self.head.still_until(t_s):
            count -= 1
        if not count:
            return np.empty((0, INPUTS))
        volts = np.array(self.head.volts(self._middle_s(ends_us[0], period_us)))
        noise = self._noise.rows(int(ends_us[0] // period_us), count)  # the periods are binary fractions: no gap
        for at_us, delta in self._steps:
            if ends_us[0] - at_us < FILTER_PERIODS * period_us:
                missing = [[1.0 - sinc3_step((end_us - at_us) / period_us)] for end_us in ends_us[:count]]
                volts = volts - np.array(missing) * delta
        return volts + noise

    def converted(self, end_us: float, period_us: float) -> list[float]:
        """Volts of the conversion that ends at end_us, one per input."""
        volts = self.head.volts(self._middle_s(end_us, period_us))
        if self._steps:
            volts = self._unsettled(volts, end_us, period_us)
        noise = self._noise.at(int(end_us // period_us))
        return [v + n for v, n in zip(volts, noise, strict=True)]

    def _middle_s(self, end_us: float, period_us: float) -> float:
        return (end_us - 0.5 * FILTER_PERIODS * period_us) * 1e-6

    def _unsettled(self, volts: list[float], end_us: float, period_us: float) -> list[float]:
        self._forget(end_us, period_us)
        for at_us, delta in self._steps:
            missing = 1.0 - sinc3_step((end_us - at_us) / period_us)
            volts = [v - missing * d for v, d in zip(volts, delta, strict=True)]
        return volts

    def _forget(self, t_us: float, period_us: float) -> None:
        self._steps = [step for step in self._steps if t_us - step[0] < FILTER_PERIODS * period_us]


def noise_level(board: Board, world: World) -> NoiseLevel:
    """Noise of the inputs: the bridges' from the sensor's data sheet, the others' from the converter's."""
    sensor, rate_hz = board.sensor, board.adc.sample_hz
    v_per_rthz = 1e-3 * sensor.noise_nt_per_rthz * 1e-3 * sensor.sensitivity_mv_per_v_per_ut * sensor.bridge_v
    white_v = [CONVERTER_NOISE_V] * INPUTS
    flicker_v2 = [0.0] * INPUTS
    for name in AXES:
        channel = getattr(board.adc.channels, name)
        white_v[channel] = world.noise * v_per_rthz * math.sqrt(0.5 * rate_hz)
        flicker_v2[channel] = (world.flicker * v_per_rthz) ** 2 * sensor.corner_hz
    return NoiseLevel(tuple(white_v), tuple(flicker_v2), 1.0 / rate_hz)
