"""What the cross field does to a reading and to a compass (thesis fig. 3.6, 3.8, 5.1-5.3).

A reading is the output scaled to the field for a small field alone: B = H_k V/a (3.14 and 3.36 with H_x = 0).
"""

import numpy as np

from barberpole.law.film import Array, bridge, flipped


def reading_ut(h_s_ut: Array, h_e_ut: Array, h_k_ut: Array, flipping: bool = False) -> Array:
    """Field that the sensor reports, µT: eq. 3.13, or SET and RESET together."""
    law = flipped if flipping else bridge
    return np.asarray(h_k_ut) * law(h_s_ut, h_e_ut, h_k_ut)


def reading_error_ut(h_s_ut: Array, h_e_ut: Array, h_k_ut: Array, flipping: bool = False) -> Array:
    """Reading less field, µT (fig. 3.6, 3.8, 5.3)."""
    return reading_ut(h_s_ut, h_e_ut, h_k_ut, flipping) - np.asarray(h_s_ut)


def turn_readings_ut(field_ut: float, h_k_ut: Array, heading_rad: Array, flipping: bool = False) -> tuple[Array, Array]:
    """Readings (x, y) of a level two-axis sensor at these headings, µT (fig. 5.1).

    The easy axis of the x bridge is y and that of the y bridge is x.
    """
    x, y = field_ut * np.cos(heading_rad), field_ut * np.sin(heading_rad)
    return reading_ut(x, y, h_k_ut, flipping), reading_ut(y, x, h_k_ut, flipping)


def compass_error_rad(field_ut: float, h_k_ut: Array, heading_rad: Array, flipping: bool = False) -> Array:
    """Heading by eq. 1.1 from those readings less the true one, rad, within ±pi."""
    x, y = turn_readings_ut(field_ut, h_k_ut, heading_rad, flipping)
    return np.angle(np.exp(1j * (np.arctan2(y, x) - np.asarray(heading_rad))))
