"""A trajectory as DAC codes for one board, checked against what its parts can do.

    code = round(2**(bits-1) (1 + i / full_scale)),   i = B / coil constant          (1)

A board works in trajectory units: u = i / unit_ma, |u| <= 1 on every axis, computed from the code and not from the
wanted field, so that rounding to codes is no error of the run.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from barberpole.board import Board
from barberpole.driver_board import Driver
from barberpole.errors import LimitError, must
from barberpole.trajectory.shapes import AXES, Array, Trajectory, sphere


@dataclass(frozen=True)
class CodeTable:
    """What the firmware plays.

    codes       (n, 3) uint16, DAC codes of the x, y and z coil
    unit_ma     (3,) current of one trajectory unit
    full_scale_ma, zero   of the board's DAC: i = (code - zero) / zero * full_scale_ma
    block       as of the trajectory
    """

    name: str
    codes: Array
    unit_ma: tuple[float, ...]
    full_scale_ma: tuple[float, ...]
    zero: int
    block: int

    @property
    def points(self) -> int:
        return len(self.codes)

    @property
    def current_ma(self) -> Array:
        """(n, 3) mA, as the codes command it."""
        return (self.codes.astype(float) - self.zero) / self.zero * np.asarray(self.full_scale_ma)

    @property
    def units(self) -> Array:
        """(n, 3) in trajectory units."""
        return self.current_ma / np.asarray(self.unit_ma)

    @property
    def bytes(self) -> bytes:
        """The codes as the firmware stores them: uint16, little-endian, x y z of each point."""
        return self.codes.astype("<u2").tobytes()

    @property
    def id(self) -> str:
        """12 hex digits that change with any code or unit."""
        units = np.asarray([*self.unit_ma, *self.full_scale_ma, self.zero, self.block], "<f8").tobytes()
        return hashlib.sha256(self.bytes + units).hexdigest()[:12]


def for_board(board: Board) -> Trajectory:
    """The self-calibration run that the board file asks for. Raises InputError."""
    return sphere(tuple(board.selfcal.radii_ut), board.selfcal.points)


def code_table(trajectory: Trajectory, board: Board) -> CodeTable:
    """Eq. (1). Raises LimitError where a current, a code or the field exceeds what the board bears."""
    sensor = board.sensor
    _within(np.abs(trajectory.field_ut), sensor.range_ut, "µT", "the coil field", "the sensor's range")
    constant = (sensor.offset_coil_ut_per_ma,) * 3
    return codes_of(trajectory, constant, board.coils.full_scale_ma, board.coils.max_ma, board.dac.bits)


def for_driver(driver: Driver) -> Trajectory:
    """The turn of the field that the driver file asks for. Raises InputError."""
    return sphere(tuple(driver.drive.radii_ut), driver.drive.points)


def driver_table(trajectory: Trajectory, driver: Driver) -> CodeTable:
    """Eq. (1) for a Helmholtz coil. Raises LimitError where a current or a code exceeds what the driver bears."""
    coils = driver.coils
    return codes_of(trajectory, coils.ut_per_ma, coils.full_scale_ma, coils.max_ma, driver.dac.bits)


def codes_of(
    trajectory: Trajectory, ut_per_ma: Sequence[float], full_ma: Sequence[float], max_ma: float, bits: int
) -> CodeTable:
    """Eq. (1) for coils of these constants and ends of scale, three each."""
    current_ma = trajectory.field_ut / np.asarray(ut_per_ma, float)
    _within(np.abs(current_ma), max_ma, "mA", "the coil current", "coils.max_ma")
    zero = 1 << (bits - 1)
    full_scale_ma = np.asarray(full_ma, float)
    codes = np.round(zero * (1.0 + current_ma / full_scale_ma))
    if codes.min() < 0 or codes.max() > 2 * zero - 1:
        got = f"{codes.min():.0f} to {codes.max():.0f}"
        raise LimitError(must("DAC codes", f"within 0 to {2 * zero - 1} (coils.full_scale_ma)", got))
    largest = np.max(np.abs(codes - zero) / zero * full_scale_ma, axis=0)
    unit_ma = np.where(largest > 0, largest, full_scale_ma)
    return CodeTable(
        trajectory.name,
        codes.astype(np.uint16),
        tuple(float(u) for u in unit_ma),
        tuple(float(f) for f in full_scale_ma),
        zero,
        trajectory.block,
    )


def _within(size: Array, limit: float, unit: str, what: str, why: str) -> None:
    """`size` (n, 3) nowhere above `limit`."""
    point, axis = np.unravel_index(np.argmax(size), size.shape)
    worst = float(size[point, axis])
    if worst > limit * (1 + 1e-9):
        where = f"point {point}, axis {AXES[axis]}"
        raise LimitError(must(what, f"at most {limit:g} {unit} ({why})", f"{worst:.4g} {unit}", where))
