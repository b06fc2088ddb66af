"""AMR law of one film and of the bridge, flipped and not (thesis 3.2-3.14, 3.28-3.36, 5.1-5.2).

    x = H_y / (H_k + H_x)                    tangent of the magnetisation's angle, small      (3.4)
    V = a x sqrt(1 - x^2)                    bridge with barber poles                         (3.13)

H_y is the field along the sensitive axis (here h_s_ut), H_x that along the easy axis (h_e_ut), H_k the anisotropy field
(h_k_ut); a = V_supply dR/R. All fields in µT, any shapes that broadcast; outputs are V/a, without unit. |x| <= 1.
"""

import numpy as np

Array = np.ndarray | float


def small_angle(h_s_ut: Array, h_e_ut: Array, h_k_ut: Array) -> Array:
    """Angle of the magnetisation in rad, eq. 3.4."""
    return np.asarray(h_s_ut) / (np.asarray(h_k_ut) + h_e_ut)


def energy(angle_rad: Array, h_s_ut: Array, h_e_ut: Array, h_k_ut: Array) -> Array:
    """Energy over mu0 M_s in µT, eq. 3.2; its minimum is the angle that 3.3 and 3.4 approximate."""
    sin, cos = np.sin(angle_rad), np.cos(angle_rad)
    return -(h_s_ut * sin + h_e_ut * cos) + 0.5 * np.asarray(h_k_ut) * sin**2


def resistance(h_s_ut: Array, h_e_ut: Array, h_k_ut: Array, ratio: float) -> Array:
    """Resistance of a plain strip over that without field, eq. 3.8; `ratio` is dR/R. Beyond |x| = 1 it saturates."""
    return 1.0 - ratio * np.minimum(np.abs(small_angle(h_s_ut, h_e_ut, h_k_ut)), 1.0) ** 2


def barber_pole(h_s_ut: Array, h_e_ut: Array, h_k_ut: Array, ratio: float, sign: int = 1) -> Array:
    """Resistance of a strip whose current flows at +45° or -45° (`sign`), over that without field, eq. 3.9 and 3.10."""
    return 1.0 - ratio * (0.5 + sign * bridge(h_s_ut, h_e_ut, h_k_ut))


def bridge(h_s_ut: Array, h_e_ut: Array, h_k_ut: Array) -> Array:
    """Output of the bridge over a, eq. 3.13 (5.1)."""
    x = small_angle(h_s_ut, h_e_ut, h_k_ut)
    return x * np.sqrt(1.0 - x**2)


def bridge_linear(h_s_ut: Array, h_e_ut: Array, h_k_ut: Array) -> Array:
    """Output for H_k far above both fields, eq. 3.14."""
    return small_angle(h_s_ut, h_e_ut, h_k_ut)


def bridge_reset(h_s_ut: Array, h_e_ut: Array, h_k_ut: Array) -> Array:
    """Output after RESET: H_k changes its sign, eq. 3.29 in 3.13."""
    return bridge(h_s_ut, h_e_ut, -np.asarray(h_k_ut))


def flipped(h_s_ut: Array, h_e_ut: Array, h_k_ut: Array) -> Array:
    """Half the difference of SET and RESET, with the square root in full: what 3.30-3.34 expand."""
    return 0.5 * (bridge(h_s_ut, h_e_ut, h_k_ut) - bridge_reset(h_s_ut, h_e_ut, h_k_ut))


def flipped_series(h_s_ut: Array, h_e_ut: Array, h_k_ut: Array) -> Array:
    """Half the difference of SET and RESET to third order in x, eq. 3.34."""
    x_1 = small_angle(h_s_ut, h_e_ut, h_k_ut)
    x_2 = small_angle(h_s_ut, h_e_ut, -np.asarray(h_k_ut))
    return 0.25 * (x_1 - x_2) * (2.0 - x_2**2 - x_1**2 - x_1 * x_2)


def flipped_without_cross_field(h_s_ut: Array, h_k_ut: Array) -> Array:
    """3.34 for H_x^2 far below H_k^2, eq. 3.35; its first term alone is 3.36."""
    x = np.asarray(h_s_ut) / h_k_ut
    return 0.5 * x * (2.0 - x**2)


def cross_slope(h_s_ut: Array, h_e_ut: Array, h_k_ut: Array) -> Array:
    """Slope of the output over the cross field in 1/µT: the derivative of 5.1."""
    x = small_angle(h_s_ut, h_e_ut, h_k_ut)
    return -x / (np.asarray(h_k_ut) + h_e_ut) * (1.0 - 2.0 * x**2) / np.sqrt(1.0 - x**2)


def cross_slope_printed(h_s_ut: Array, h_e_ut: Array, h_k_ut: Array) -> Array:
    """Eq. 5.2 as printed, in 1/µT: the derivative of x sqrt(1 + x^2), so its signs do not go with 5.1."""
    x = small_angle(h_s_ut, h_e_ut, h_k_ut)
    root = np.sqrt(x**2 + 1.0)
    return -(x**3 / root + x * root) / (np.asarray(h_k_ut) + h_e_ut)


def shape_anisotropy_ut(thickness: float, width: float, length: float, m_s_ut: float, h_film_ut: float) -> float:
    """Anisotropy field of a strip in µT, eq. 3.27, from its dimensions (one unit), M_s and the film's own in µT."""
    return (thickness / width - thickness / length) * m_s_ut - h_film_ut
