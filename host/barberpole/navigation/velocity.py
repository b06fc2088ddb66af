"""Velocity from the gradient of the field (thesis 1.2).

    dB/dt = (dB/dx) dx/dt                                                            (1.2)

A body moves through a field that is constant in time; several sensors on it give the gradient, one gives the change.
"""

import numpy as np

from barberpole.errors import InputError, must

Array = np.ndarray


def gradient_ut_per_m(field_ut: Array, position_m: Array) -> Array:
    """Gradient (3, 3), entry (i, j) = dB_i / dx_j, from sensors (n, 3) at positions (n, 3), by least squares.

    Raises InputError where the sensors lie in one plane, so that one direction is not seen.
    """
    position = np.asarray(position_m, float) - np.mean(position_m, axis=0)
    if np.linalg.matrix_rank(position) < 3:
        raise InputError(must("the sensors of a gradient", "at least four, not in one plane", f"{len(position)}"))
    field = np.asarray(field_ut, float) - np.mean(field_ut, axis=0)
    slopes, *_ = np.linalg.lstsq(position, field, rcond=None)
    return slopes.T


def along_gradient_ut_per_m(near_ut: Array, far_ut: Array, baseline_m: float) -> Array:
    """Derivative of the field along the baseline between two sensors, any shape."""
    return (np.asarray(far_ut) - near_ut) / baseline_m


def velocity_m_per_s(rate_ut_per_s: Array, gradient: Array) -> Array:
    """Velocity (3,) from dB/dt (3,) and the gradient (3, 3), eq. 1.2 solved; least squares where it is singular."""
    return np.linalg.lstsq(np.asarray(gradient, float), np.asarray(rate_ut_per_s, float), rcond=None)[0]


def speed_along_m_per_s(rate_ut_per_s: Array, slope_ut_per_m: Array) -> float:
    """Speed along the baseline of two sensors, from all components of 1.2 at once."""
    slope = np.asarray(slope_ut_per_m, float)
    return float(np.dot(slope, rate_ut_per_s) / np.dot(slope, slope))
