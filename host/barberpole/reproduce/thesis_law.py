"""Thesis chapters 1, 3.1 to 3.4.2 and 5.1: the law of the bridge, its errors, its supply; heading and gradient.

A printed equation is evaluated at the point of figure 3.8 where its approximations matter most.
"""

from functools import partial

import numpy as np
from scipy.optimize import minimize_scalar

from barberpole.law import film, reading, supply
from barberpole.navigation.heading import heading_deg, tilted_heading_deg
from barberpole.navigation.velocity import velocity_m_per_s
from barberpole.reproduce.row import Row
from barberpole.units import UT_PER_GAUSS

_row = partial(Row, "thesis")

H_Y, H_X_LIMIT, H_K = 1.0 * UT_PER_GAUSS, 3.0 * UT_PER_GAUSS, 8.0 * UT_PER_GAUSS  # fig. 3.8
H_K_STIFF = 20.0 * UT_PER_GAUSS  # fig. 5.6
TURN_UT = 1.0 * UT_PER_GAUSS  # fig. 5.1
BRIDGE_MA = 5.0  # 3.4.2
LEG_OHM, EXCESS_OHM, ALPHA = 1100.0, 1.0, 0.0025  # data sheet; the excess is an example
SUPPLY_V = 5.5
STEP = 1e-3  # of numerical derivatives, in the unit of what varies


def rows() -> list[Row]:
    """All of them, in the order of the thesis."""
    return [*_navigation(), *_film(), *_supply(), *_flipped(), *_compass(), *_slope()]


def _derivative(function, at: float) -> float:
    return float(function(at + STEP) - function(at - STEP)) / (2 * STEP)


def _navigation() -> list[Row]:
    level = heading_deg(0.6, 0.8, 3.0)
    vectors = tilted_heading_deg(np.array([0.6, 0.8, -2.0]), np.array([0.0, 0.0, 9.81]), 3.0)
    gradient, speed = np.array([[2.0, 0.3, 0.1], [0.3, -1.5, 0.4], [0.1, 0.4, -0.5]]), np.array([1.4, 0.2, -0.3])
    found = velocity_m_per_s(gradient @ speed, gradient)
    return [
        _row("eq. 1.1", "heading at H = (0.6, 0.8), declination 3°", float(level), float(vectors), "°", "by vectors"),
        _row("eq. 1.2", "first component of a velocity", speed[0], float(found[0]), "m/s", "dB/dt by 1.2, solved"),
    ]


def _film() -> list[Row]:
    angle = minimize_scalar(film.energy, bracket=(0.0, 0.2), args=(H_Y, H_X_LIMIT, H_K)).x
    x = float(film.small_angle(H_Y, H_X_LIMIT, H_K))
    whole = float(np.sin(angle) * np.cos(angle))
    linear = float(film.bridge_linear(H_Y, H_X_LIMIT, H_K))
    ratio = 0.02
    plus, minus = (float(film.barber_pole(H_Y, H_X_LIMIT, H_K, ratio, sign)) for sign in (1, -1))
    of_legs = (minus - plus) / (minus + plus) / ratio
    bridge = float(film.bridge(H_Y, H_X_LIMIT, H_K))
    energy = "3.2 at its minimum"
    return [
        _row("eq. 3.3-3.4", "angle at H_y = 1 G, H_x = 3 G, H_k = 8 G", x, float(angle), "rad", energy),
        _row(
            "eq. 3.9-3.12",
            "output of the bridge over a, from its legs",
            bridge,
            of_legs,
            "",
            "dR/R = 2 %; 3.12 leaves out dR/2R",
        ),
        _row("eq. 3.13, 5.1", "output over a, there", bridge, whole, "", f"sin φ cos φ, {energy}"),
        _row("eq. 3.14", "linear output over a, there", linear, whole, "", f"sin φ cos φ, {energy}"),
    ]


def _supply() -> list[Row]:
    bridge, current_a = supply.unbalanced(LEG_OHM, EXCESS_OHM, ALPHA), BRIDGE_MA * 1e-3
    on_voltage = _derivative(lambda warm: supply.offset_on_voltage_v(bridge, SUPPLY_V, warm), 0.0)
    on_current = _derivative(lambda warm: supply.offset_on_current_v(bridge, current_a, warm), 0.0)
    sensitivity = _derivative(lambda warm: supply.sensitivity_on_voltage(bridge, warm), 10.0)
    printed = float(supply.sensitivity_drift_on_voltage_per_k(bridge, 10.0))
    after_set = _derivative(lambda warm: supply.set_and_reset_v(bridge, current_a, 1.0, warm)[0], 0.0)
    flipped = _derivative(lambda warm: supply.demodulated_v(bridge, current_a, 1.0, warm), 0.0)
    printed_set = current_a * LEG_OHM * EXCESS_OHM * ALPHA / (4 * LEG_OHM + EXCESS_OHM)
    drift = supply.offset_drift_on_current_v_per_k(bridge, current_a)
    example = f"example: {LEG_OHM:g} Ω legs, {EXCESS_OHM:g} Ω excess, {BRIDGE_MA:g} mA, 0.25 %/K"
    return [
        _row("eq. 3.17", "drift of the offset on a voltage", 0.0, round(on_voltage, 12), "V/K"),
        _row("eq. 3.22", "drift of the sensitivity on a voltage, 10 K up", printed, sensitivity, "1/K", "of 3.19"),
        _row("eq. 3.25", "drift of the offset on a current", drift * 1e6, on_current * 1e6, "µV/K", example),
        _row("eq. 3.42", "drift of SET or RESET", printed_set * 1e6, after_set * 1e6, "µV/K", "of 3.40"),
        _row("eq. 3.43", "drift of the demodulated offset", 0.0, round(flipped, 12), "V/K", "of 3.40-3.41"),
    ]


def _flipped() -> list[Row]:
    cross = np.linspace(-H_X_LIMIT, H_X_LIMIT, 61)

    def worst(h_k: float, flipping: bool) -> float:
        return float(np.max(np.abs(reading.reading_error_ut(H_Y, cross, h_k, flipping)))) / UT_PER_GAUSS

    series, full = (float(f(H_Y, H_X_LIMIT, H_K)) for f in (film.flipped_series, film.flipped))
    short = float(film.flipped_without_cross_field(H_Y, H_K))
    calm = float(film.flipped(H_Y, 0.0, H_K))
    span = "largest error at H_y = 1 G, |H_x| <= 3 G"
    return [
        _row("eq. 3.30-3.34", "flipped output over a at H_y = 1 G, H_x = 3 G", series, full, "", "roots in full"),
        _row("eq. 3.35", "flipped output over a, H_x = 0", short, calm, "", "roots in full"),
        _row("eq. 3.36", "the same, first term", H_Y / H_K, calm, "", "roots in full"),
        _row("fig. 3.6, 3.8", f"{span}, H_k = 8 G, one magnetisation", None, worst(H_K, False), "G"),
        _row("fig. 3.8", f"{span}, H_k = 8 G, flipped", None, worst(H_K, True), "G"),
        _row("fig. 3.6, 5.3", f"{span}, H_k = 20 G, one magnetisation", None, worst(H_K_STIFF, False), "G"),
    ]


def _compass() -> list[Row]:
    heading = np.linspace(0.0, 2 * np.pi, 721)
    rows = []
    for name, flipping in (("one magnetisation", False), ("flipped", True)):
        error = np.max(np.abs(reading.compass_error_rad(TURN_UT, H_K, heading, flipping)))
        x, _ = reading.turn_readings_ut(TURN_UT, H_K, heading, flipping)
        wrong = float(np.max(np.abs(x - TURN_UT * np.cos(heading)))) / UT_PER_GAUSS
        rows.append(_row("fig. 5.1", f"largest error of a reading over a turn, 1 G, {name}", None, wrong, "G"))
        rows.append(_row("fig. 5.1", f"largest error of the heading, {name}", None, float(np.rad2deg(error)), "°"))
    return rows


def _slope() -> list[Row]:
    printed = float(film.cross_slope_printed(H_Y, 0.0, H_K)) * UT_PER_GAUSS
    ours = float(film.cross_slope(H_Y, 0.0, H_K)) * UT_PER_GAUSS
    x = float(film.small_angle(H_Y, 0.0, H_K))
    why = (
        "5.2 is the derivative of x√(1 + x²), but 5.1 is x√(1 − x²): the printed factor (1 + 2x²)/√(1 + x²) should be"
        f" (1 − 2x²)/√(1 − x²), {(1 + 2 * x**2) / np.sqrt(1 + x**2):.4f} against"
        f" {(1 - 2 * x**2) / np.sqrt(1 - x**2):.4f} at x = 1/8"
    )
    steep = [float(film.cross_slope(share * H_Y, 0.0, H_K)) * UT_PER_GAUSS for share in (0.0, 0.5)]
    return [
        _row("eq. 5.2", "dV/dH_x over a at H_y = 1 G, H_x = 0, H_k = 8 G", printed, ours, "1/G", why),
        _row("fig. 5.2", "dV/dH_x over a at H_y = 0.5 G", None, steep[1], "1/G"),
        _row("fig. 5.2", "dV/dH_x over a at H_y = 0", 0.0, abs(steep[0]), "1/G"),
    ]
