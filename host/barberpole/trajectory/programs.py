"""The field programs of the article (2.4), as trajectories and the times that go with them.

LIN-60000 holds constant fields of up to 60 000 nT for 25 s each (fig. 2): null field, then a staircase to +60 µT, down
to -60 µT and back on x, on y, and on z. The article draws the levels and does not print them; the pitch is ours to
choose. Each step of a program is one row of the trajectory.
"""

from dataclasses import dataclass

import numpy as np

from barberpole.errors import InputError, must
from barberpole.trajectory.shapes import Trajectory, sine

LIN_PEAK_UT = 60.0  # article 2.4: the name of the program, in nT
LIN_HOLD_S = 25.0  # article 2.4
SINE_PEAK_TO_PEAK_UT = 4.0  # article 2.4: 4000 nT
FREQUENCIES_HZ = (1.0, 3.7, 10.0, 25.0, 37.0, 61.0)  # article 2.4
SINE_POINTS = 24  # of a cycle


@dataclass(frozen=True)
class Tone:
    """A sine on one axis at a frequency; its points are 1 / (frequency_hz SINE_POINTS) apart in time."""

    frequency_hz: float
    trajectory: Trajectory


def lin_60000(pitch_ut: float = 10.0) -> Trajectory:
    """Null field and staircases on the three axes, one row for each field that is held for LIN_HOLD_S.

    Raises InputError unless the pitch divides the peak.
    """
    levels = LIN_PEAK_UT / pitch_ut if pitch_ut > 0 else 0.0
    if levels < 1 or abs(levels - round(levels)) > 1e-9:
        raise InputError(must("the pitch", f"a part of {LIN_PEAK_UT:g} µT", f"{pitch_ut:g} µT"))
    up = pitch_ut * np.arange(round(levels) + 1)
    stairs = np.concatenate([up, up[-2::-1], -up[1:], -up[-2::-1]])
    field = np.zeros((3 * len(stairs), 3))
    for axis in range(3):
        field[axis * len(stairs) : (axis + 1) * len(stairs), axis] = stairs
    return Trajectory("lin_60000", field)


def frequency_program(axis: str, cycles: int = 60) -> tuple[Tone, ...]:
    """Sines of 4000 nT peak to peak at the frequencies of the article, one after the other."""
    half = 0.5 * SINE_PEAK_TO_PEAK_UT
    return tuple(Tone(f, sine(half, axis, cycles, SINE_POINTS)) for f in FREQUENCIES_HZ)


def turn_over_program(hold: int = 100) -> tuple[Trajectory, np.ndarray]:
    """Null field while the sensor lies as normal and after 180° about x, y and z; and the column `turn` (4 hold,)."""
    if hold < 2:
        raise InputError(must("hold", "at least 2 points", hold))
    return Trajectory("turn_over", np.zeros((4 * hold, 3))), np.repeat(np.arange(4.0), hold)


def noise_program(points: int) -> Trajectory:
    """Null field throughout, for the noise (article 2.4: five minutes in a shield)."""
    return Trajectory("noise", np.zeros((points, 3)))
