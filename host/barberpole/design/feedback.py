"""Feedback operation: the offset coil nulls the field that the bridge sees (thesis 5.1.1.2, table 5.1).

    c = G f(H_s - c, H_e),   reading = c (1 + 1/G)                                   (1)

f is the reading of the bare sensor (3.13 scaled to the field), c the coil's field, G the gain of the loop for a small
field. The bridge sees H_s - c = H_s / (1 + G), so the error of its law falls by about 1 + G. The price is the current:

    P = R (i B)^2          in the coil of resistance R that needs the current i for one unit of field                (2)
    P = V_cc i B           from the supply of the amplifier that drives it                                           (3)
"""

from dataclasses import dataclass

import numpy as np

from barberpole.law.film import Array, cross_slope, small_angle
from barberpole.law.reading import reading_ut

NEWTON_STEPS = 6  # from the linear answer; convergence is quadratic


@dataclass(frozen=True)
class OffsetCoil:
    """An offset coil: resistance, and the current for one microtesla."""

    name: str
    resistance_ohm: float
    ma_per_ut: float


def coil_power_mw(coil: OffsetCoil, field_ut: Array) -> Array:
    """Eq. (2), mW."""
    return 1e-3 * coil.resistance_ohm * (coil.ma_per_ut * np.asarray(field_ut)) ** 2


def supply_power_mw(coil: OffsetCoil, field_ut: Array, supply_v: float) -> Array:
    """Eq. (3), mW."""
    return supply_v * coil.ma_per_ut * np.abs(field_ut)


def coil_field_ut(h_s_ut: Array, h_e_ut: Array, h_k_ut: float, loop_gain: float) -> Array:
    """Field of the coil in µT that satisfies (1), with the easy-axis field h_e_ut."""
    stiffness = loop_gain * h_k_ut / (h_k_ut + np.asarray(h_e_ut))
    coil = np.asarray(h_s_ut) * stiffness / (1.0 + stiffness)
    for _ in range(NEWTON_STEPS):
        seen = h_s_ut - coil
        excess = coil - loop_gain * reading_ut(seen, h_e_ut, h_k_ut)
        coil = coil - excess / (1.0 + loop_gain * h_k_ut * _slope(seen, h_e_ut, h_k_ut))
    return coil


def feedback_reading_ut(h_s_ut: Array, h_e_ut: Array, h_k_ut: float, loop_gain: float) -> Array:
    """What a sensor in a loop of this gain reports, µT, eq. (1)."""
    return coil_field_ut(h_s_ut, h_e_ut, h_k_ut, loop_gain) * (1.0 + 1.0 / loop_gain)


def cross_sensitivity(h_s_ut: Array, h_e_ut: Array, h_k_ut: float, loop_gain: float = 0.0) -> Array:
    """Change of the reading with the cross field (fig. 5.2), without unit; the loop divides H_s by 1 + G."""
    seen_ut = np.asarray(h_s_ut) / (1.0 + loop_gain)
    return h_k_ut * cross_slope(seen_ut, h_e_ut, h_k_ut)


def _slope(h_s_ut: Array, h_e_ut: Array, h_k_ut: float) -> Array:
    """Derivative of 3.13 over H_s in 1/µT."""
    x = small_angle(h_s_ut, h_e_ut, h_k_ut)
    return (1.0 - 2.0 * x**2) / np.sqrt(1.0 - x**2) / (h_k_ut + np.asarray(h_e_ut))
