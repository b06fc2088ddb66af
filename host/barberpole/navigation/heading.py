"""Heading of a compass, level or tilted (thesis 1.1).

    heading = arctan2(H_y, H_x) + declination                                        (1.1)

x points ahead, y to the left, z up; headings count clockwise from true north. With those axes a level sensor that faces
magnetic east has the field along +y. Any units of field; angles in degrees.
"""

import numpy as np

Array = np.ndarray | float

FULL_TURN_DEG = 360.0


def heading_deg(h_x: Array, h_y: Array, declination_deg: Array = 0.0) -> Array:
    """Heading of a level sensor, eq. 1.1, in 0..360."""
    return (np.rad2deg(np.arctan2(h_y, h_x)) + declination_deg) % FULL_TURN_DEG


def tilted_heading_deg(field: Array, up: Array, declination_deg: Array = 0.0) -> Array:
    """Heading of the x axis from field and up, both (..., 3) in the sensor's axes, in 0..360.

    `up` is what an accelerometer at rest shows; its length does not matter. East is north across up, so only the part
    of the field across `up` counts, and the heading is that of x laid down on the horizon.
    """
    up = np.asarray(up, float)
    up = up / np.linalg.norm(up, axis=-1, keepdims=True)
    east = np.cross(np.asarray(field, float), up)
    north = np.cross(up, east)
    return (np.rad2deg(np.arctan2(east[..., 0], north[..., 0])) + declination_deg) % FULL_TURN_DEG


def turn_error_deg(heading: Array, truth: Array) -> Array:
    """Difference of two headings, within -180..180."""
    return (np.asarray(heading) - truth + FULL_TURN_DEG / 2) % FULL_TURN_DEG - FULL_TURN_DEG / 2
