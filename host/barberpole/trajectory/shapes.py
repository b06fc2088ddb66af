"""Shapes of trajectories. All are fields in µT, (n, 3), one row a point, x y z of the coils.

Points on a sphere after thesis 6.1, with radius a and the angles alpha (elevation) and beta (azimuth):

    B = a (cos alpha cos beta, cos alpha sin beta, sin alpha)                        (1)
"""

from dataclasses import dataclass

import numpy as np

from barberpole.errors import InputError, must

Array = np.ndarray

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))  # successive azimuths that never line up
AXES = "xyz"


@dataclass(frozen=True)
class Trajectory:
    """A named sequence of coil fields.

    field_ut    (n, 3) in µT
    block       points after which the sequence is balanced again: over each block the mean field is zero and every
                axis has the same mean square. 0: it is not balanced
    """

    name: str
    field_ut: Array
    block: int = 0

    @property
    def points(self) -> int:
        return len(self.field_ut)


def sphere(radii_ut: tuple[float, ...], points: int) -> Trajectory:
    """Points evenly over spheres of these radii, eq. (1).

    They come as antipodal pairs, +B and -B next to each other in time, so that an ambient field drops out of each
    difference; and as orthogonal triads, one on each radius in turn, so that a block of 6 len(radii) points shows
    every axis the same mean square: a term of even order shifts all block means alike. Two radii or more tell such a
    term from the constant. Raises InputError unless `points` is a multiple of the block.
    """
    _require_radii(radii_ut)
    block = 6 * len(radii_ut)
    if points < block or points % block:
        what = f"the points on {len(radii_ut)} radii"
        raise InputError(must(what, f"a multiple of {block} (three antipodal pairs on each radius)", points))
    triads = points // 6
    rows = []
    for k in range(triads):
        radius = radii_ut[k % len(radii_ut)]
        rows.append(_pairs(radius * _triad(k, triads), first=1.0 if k // len(radii_ut) % 2 else -1.0))
    return Trajectory("sphere", np.concatenate(rows), block)


def axes(amplitudes_ut: tuple[float, ...], repeats: int = 1) -> Trajectory:
    """One coil at a time: +x -x +y -y +z -z at each amplitude, all of it `repeats` times."""
    _require_radii(amplitudes_ut)
    if repeats < 1:
        raise InputError(must("repeats", "at least 1", repeats))
    once = np.concatenate([_pairs(a * np.eye(3), first=1.0) for a in amplitudes_ut])
    return Trajectory("axes", np.tile(once, (repeats, 1)), len(once))


def steps(levels_ut: tuple[float, ...], axis: str, hold: int = 1) -> Trajectory:
    """A staircase on one axis, each level held for `hold` points."""
    if not levels_ut or hold < 1:
        raise InputError(must("the staircase", "at least one level, held for at least 1 point", f"{levels_ut}, {hold}"))
    return Trajectory("steps", _on_axis(np.repeat(np.asarray(levels_ut, float), hold), axis))


def sine(amplitude_ut: float, axis: str, cycles: int, points_per_cycle: int) -> Trajectory:
    """A sine on one axis, sampled evenly; whole cycles, so its mean is zero."""
    if cycles < 1 or points_per_cycle < 3:
        raise InputError(must("the sine", "at least 1 cycle of 3 points", f"{cycles} of {points_per_cycle}"))
    phase = 2.0 * np.pi * np.arange(cycles * points_per_cycle) / points_per_cycle
    return Trajectory("sine", _on_axis(amplitude_ut * np.sin(phase), axis))


def direction(alpha: Array | float, beta: Array | float) -> Array:
    """Eq. (1) with a = 1; angles in rad."""
    return np.array([np.cos(alpha) * np.cos(beta), np.cos(alpha) * np.sin(beta), np.sin(alpha) + 0.0 * beta])


def _triad(k: int, count: int) -> Array:
    """Three orthogonal unit rows: point k of a golden spiral over the upper half, and two across, turned by k."""
    alpha = np.arcsin((k + 0.5) / count)
    beta = k * GOLDEN_ANGLE
    first, up = direction(alpha, beta), direction(alpha + np.pi / 2, beta)
    across = np.cross(first, up)
    spin = k * GOLDEN_ANGLE * GOLDEN_ANGLE
    return np.array([first, np.cos(spin) * up + np.sin(spin) * across, np.cos(spin) * across - np.sin(spin) * up])


def _pairs(rows: Array, first: float) -> Array:
    """Each row with both signs, next to each other; the sign that comes first is given."""
    return np.stack([first * rows, -first * rows], axis=1).reshape(-1, 3)


def _on_axis(values: Array, axis: str) -> Array:
    if axis not in AXES or len(axis) != 1:
        raise InputError(must("the axis", "one of x, y, z", repr(axis)))
    field = np.zeros((len(values), 3))
    field[:, AXES.index(axis)] = values
    return field


def _require_radii(radii_ut: tuple[float, ...]) -> None:
    if not radii_ut or not all(np.isfinite(r) and r > 0 for r in radii_ut):
        raise InputError(must("the radii", "one or more positive fields in µT", radii_ut))
