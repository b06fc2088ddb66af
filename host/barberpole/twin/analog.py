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
WAITING_US = 8000.0  # for so long a conversion may wait to be computed
CONVERTER_NOISE_V = 8e-6  # ADS131M08 at gain 1 and 8 kHz, rms of one conversion (data sheet, noise table, about)


class Head(Protocol):
    """What the inputs look at."""

    still_s: tuple[float, float]
    """s. A stretch of time in which nothing that the voltages hang on moves by itself, as far as it was looked at."""

    def volts(self, t_s: float) -> list[float]:
        """Voltage on every input at t_s, without noise; the same list while nothing changes, or a new one."""
        ...

    def coming(self, times_s: Sequence[float]) -> list[list[float]]:
        """Voltages at times to come, up to the first that cannot be told; nothing is changed by asking."""
        ...


class AnalogInputs:
    """The voltages of all inputs, conversion by conversion."""

    def __init__(self, head: Head, noise: Noise):
        self.head = head
        self._noise = noise
        self._steps: list[tuple[float, np.ndarray]] = []

    def change(self, t_us: float, act: Callable[[], None]) -> None:
        """Do `act` to the head at t_us and remember the steps that its voltages make."""
        t_s = t_us * 1e-6
        before = self.head.volts(t_s)
        act()
        after = self.head.volts(t_s)
        if after is not before:
            oldest_us = t_us - WAITING_US - FILTER_PERIODS * LONGEST_PERIOD_US
            self._steps = [step for step in self._steps if step[0] > oldest_us]
            self._steps.append((t_us, np.subtract(after, before)))

    def will_know(self, end_us: float, t_us: float) -> bool:
        """Whether a conversion that ended at end_us can still be computed after t_us."""
        start_s, until_s = self.head.still_s
        begin_s = (end_us - FILTER_PERIODS * LONGEST_PERIOD_US) * 1e-6
        return t_us - end_us < WAITING_US and start_s <= begin_s and t_us * 1e-6 < until_s

    def volts(self, ends_us: Sequence[float], completed: int, period_us: float) -> np.ndarray:
        """Volts (n, INPUTS) of the conversions that end then: of those that are complete, the first in the row, and
        of the others up to the first that cannot be told before its time."""
        volts = self._unfiltered([(end_us - 0.5 * FILTER_PERIODS * period_us) * 1e-6 for end_us in ends_us], completed)
        count = len(volts)
        if not count:
            return volts
        for at_us, delta in self._steps:
            if ends_us[0] - at_us < FILTER_PERIODS * period_us:
                missing = [[1.0 - sinc3_step((end_us - at_us) / period_us)] for end_us in ends_us[:count]]
                volts = volts - np.array(missing) * delta
        return volts + self._noise.rows([int(end_us // period_us) for end_us in ends_us[:count]])

    def _unfiltered(self, times_s: list[float], completed: int) -> np.ndarray:
        """Volts (n, INPUTS) at these times, as far as they can be told; the first `completed` of them are over."""
        start_s, until_s = self.head.still_s
        if start_s <= times_s[0] and times_s[-1] < until_s:
            return np.array([self.head.volts(times_s[0])] * len(times_s))
        past = [self.head.volts(t_s) for t_s in times_s[:completed]]
        future = self.head.coming(times_s[completed:]) if len(times_s) > completed else []
        return np.array(past + future).reshape(-1, INPUTS)


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
