"""Helmholtz coil: two loops on the x axis, ideal or with one of them tilted (thesis 6.1.2.2, appendix A).

    B = mu0 n I / (2 R) ([1 + (1/2 - a/R)^2]^(-3/2) + [1 + (1/2 + a/R)^2]^(-3/2))    on the axis            (6.2)
    B = mu0 n I R / (4 pi) oint (...) dphi                                           one loop, off the axis (A.3)

Fields off the axis are magpylib's, checked against both. Lengths in mm, currents in mA, fields in µT; x is the axis of
the coil, y lies across it, and a tilted second loop is turned about z (A.6).
"""

from dataclasses import dataclass

import magpylib
import numpy as np
from scipy.optimize import root_scalar
from scipy.spatial.transform import Rotation

from barberpole.errors import LimitError, must

Array = np.ndarray

MU0_UT_MM_PER_MA = 0.4 * np.pi  # 4 pi 1e-7 T m/A
UT_PER_T = 1e6
GRID = 9  # points along each side of the square that is searched for the largest deviation
LARGEST_REGION = 0.5  # half side over radius up to which a uniform region is looked for
SMALLEST_REGION = 1e-3


@dataclass(frozen=True)
class CoilPair:
    """Two equal loops in series.

    spacing_mm  between the loops; the radius if not given (Helmholtz)
    tilt_rad    angular error of the loop at +x
    """

    radius_mm: float
    turns: float
    spacing_mm: float | None = None
    tilt_rad: float = 0.0

    @property
    def half_spacing_mm(self) -> float:
        return 0.5 * (self.radius_mm if self.spacing_mm is None else self.spacing_mm)


def axis_field_ut(pair: CoilPair, current_ma: float, x_mm: Array | float) -> Array:
    """Field on the axis of an ideal pair in µT, eq. 6.2 with any spacing; x_mm from the centre."""
    scale = MU0_UT_MM_PER_MA * pair.turns * current_ma / (2.0 * pair.radius_mm)
    near, far = ((pair.half_spacing_mm + s * np.asarray(x_mm)) / pair.radius_mm for s in (-1, 1))
    return scale * ((1.0 + near**2) ** -1.5 + (1.0 + far**2) ** -1.5)


def loop_field_ut(
    radius_mm: float, turns: float, current_ma: float, x_mm: float, y_mm: float, steps: int = 512
) -> Array:
    """(x, y) field in µT of one loop at the origin, eq. A.3, by the trapezoidal rule on the circle.

    The signs are those of a current that gives +x at the centre. A.5 prints the second loop with x1 - x0 in place of
    x0 - x1, which turns its y component around.
    """
    phi = 2.0 * np.pi * np.arange(steps) / steps
    distance_3 = (x_mm**2 + y_mm**2 + radius_mm**2 - 2.0 * y_mm * radius_mm * np.sin(phi)) ** 1.5
    along = np.mean((radius_mm - y_mm * np.sin(phi)) / distance_3)
    across = np.mean(x_mm * np.sin(phi) / distance_3)
    return MU0_UT_MM_PER_MA * turns * current_ma * radius_mm / 2.0 * np.array([along, across])


def field_ut(pair: CoilPair, current_ma: float, points_mm: Array) -> Array:
    """Field (n, 3) in µT at points (n, 3) in mm from the centre, by magpylib."""
    return UT_PER_T * magpylib.getB(_sources(pair, current_ma), np.asarray(points_mm) / 1e3, sumup=True).reshape(-1, 3)


def constant_ut_per_ma(pair: CoilPair) -> float:
    """Field at the centre of an ideal pair for 1 mA."""
    return float(axis_field_ut(pair, 1.0, 0.0))


def currents_ma(field: Array, constants_ut_per_ma: Array) -> Array:
    """Currents (n, 3) in mA of three coils for fields (n, 3) in µT.

    `constants_ut_per_ma` is (3, 3): column j is the field of coil j for 1 mA, so angles between the coils are undone;
    (3,) for coils at right angles.
    """
    constants = np.asarray(constants_ut_per_ma, float)
    matrix = np.diag(constants) if constants.ndim == 1 else constants
    return np.linalg.solve(matrix, np.asarray(field, float).reshape(-1, 3).T).T


def square_mm(half_side_mm: float) -> Array:
    """Points (GRID^2, 3) over a square across z, around the centre."""
    side = np.linspace(-half_side_mm, half_side_mm, GRID)
    x, y = np.meshgrid(side, side)
    return np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)


def largest_deviation(pair: CoilPair, half_side_mm: float) -> float:
    """Largest distance of the field in a square from that at its centre, over the latter."""
    field = field_ut(pair, 1.0, square_mm(half_side_mm))
    centre = field[len(field) // 2]
    return float(np.max(np.linalg.norm(field - centre, axis=1)) / np.linalg.norm(centre))


def uniform_half_side_mm(pair: CoilPair, tolerance: float) -> float:
    """Half side of the largest square in which the field deviates by at most `tolerance`, relative.

    Raises LimitError where no square between 0.001 and 0.5 radii has just that deviation.
    """

    def excess(ratio: float) -> float:
        return largest_deviation(pair, ratio * pair.radius_mm) - tolerance

    if excess(SMALLEST_REGION) > 0 or excess(LARGEST_REGION) < 0:
        least, most = (excess(r) + tolerance for r in (SMALLEST_REGION, LARGEST_REGION))
        raise LimitError(must("the tolerance", f"between {least:.2g} and {most:.2g} for this coil", f"{tolerance:g}"))
    found = root_scalar(excess, bracket=(SMALLEST_REGION, LARGEST_REGION), xtol=1e-9)
    return pair.radius_mm * float(found.root)


def radius_for_region_mm(half_side_mm: float, tolerance: float, tilt_rad: float = 0.0) -> float:
    """Radius of the smallest Helmholtz coil with that deviation over that square: only their ratio counts."""
    return half_side_mm / uniform_half_side_mm(CoilPair(1.0, 1.0, tilt_rad=tilt_rad), tolerance)


def direction_error_rad(pair: CoilPair, point_mm: Array | tuple[float, float, float] = (0.0, 0.0, 0.0)) -> float:
    """Angle between the field at a point and the x axis, rad."""
    x, y, z = field_ut(pair, 1.0, np.asarray(point_mm, float).reshape(1, 3))[0]
    return float(np.arctan2(np.hypot(y, z), x))


def resistive_power_mw(resistance_ohm: float, current_ma: float) -> float:
    """Heat in a coil, mW."""
    return 1e-3 * resistance_ohm * current_ma**2


def _sources(pair: CoilPair, current_ma: float) -> list:
    onto_x = Rotation.from_euler("y", 90, degrees=True)
    tilts = {-1: Rotation.identity(), 1: Rotation.from_euler("z", pair.tilt_rad)}
    return [
        magpylib.current.Circle(
            diameter=2e-3 * pair.radius_mm,
            current=1e-3 * current_ma * pair.turns,
            position=(1e-3 * side * pair.half_spacing_mm, 0, 0),
            orientation=tilt * onto_x,
        )
        for side, tilt in tilts.items()
    ]
