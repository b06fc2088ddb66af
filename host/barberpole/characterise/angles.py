"""Angles that a sensor gets wrong: by noise (article eq. 13), in heading and in direction.

    xi_max = arctan( sqrt(N_xy² + N_z²) / (B - N_xy) )                               (13)

N_xy and N_z are standard deviations of the noise, B the magnitude of the field, all in one unit: noise of full size
across the field on two axes, and against it on the third.
"""

import numpy as np


def noise_angle_deg(noise_xy: float, noise_z: float, field: float) -> float:
    """Eq. 13 in degrees."""
    return float(np.degrees(np.arctan2(np.hypot(noise_xy, noise_z), field - noise_xy)))


def heading_deg(field: np.ndarray) -> np.ndarray:
    """Magnetic heading (n,), 0..360°, from fields (3, n) in the frame of a level sensor: x forward, y right, z down."""
    return np.degrees(np.arctan2(-field[1], field[0])) % 360.0


def heading_error_deg(field: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Difference (n,) of the headings of two fields (3, n), in -180..180°."""
    return (heading_deg(field) - heading_deg(true) + 180.0) % 360.0 - 180.0


def alignment_error_deg(field: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Angle (n,) between two fields (3, n), exact for small angles too."""
    across = np.linalg.norm(np.cross(field, true, axis=0), axis=0)
    return np.degrees(np.arctan2(across, np.sum(field * true, axis=0)))
