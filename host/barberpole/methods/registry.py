"""The published methods by name, beside the general fit."""

from barberpole.errors import InputError, must
from barberpole.methods.answer import Method
from barberpole.methods.cross_axis_log import cross_axis_search
from barberpole.methods.linear import linear
from barberpole.methods.offset_coil import offset_coil
from barberpole.methods.over_temperature_log import temperature
from barberpole.methods.polynomial import polynomial
from barberpole.methods.scalar import ellipsoid, ellipsoid_algebraic, iterative_ellipsoid
from barberpole.methods.turn_over import turn_over_log

TURNED = "turned through all directions in a field of one magnitude"
APPLIED = "bx_ut, by_ut, bz_ut: an applied field that spans all three axes"

METHODS: tuple[Method, ...] = (
    Method("ellipsoid", "thesis 4.8-4.20", "two-step calibration algorithm, scalar calibration", TURNED, ellipsoid),
    Method("ellipsoid_algebraic", "thesis 4.19", "two-step, its least squares alone", TURNED, ellipsoid_algebraic),
    Method("iterative", "thesis 4.21-4.22", "iteration method, quadratic cost function", TURNED, iterative_ellipsoid),
    Method(
        "cross_axis_search",
        "thesis 5.6, 5.9-5.18; 5.3.3",
        "cross-axis compensation, scale factors α β γ, peak-to-peak of the norm",
        f"{TURNED}; --sensor gives H_k and easy axes",
        cross_axis_search,
    ),
    Method(
        "temperature",
        "thesis 6.1.3.2, table 6.1; article 3.1-3.2",
        "calibrations at different temperatures, quadratic bias, cubic scale factor",
        "temp_c over a range, and each piece as ellipsoid or linear needs it",
        temperature,
    ),
    Method(
        "offset_coil",
        "thesis 6.3-6.9",
        "auto-calibration with the offset coils, S_c σ_c and B_c",
        "ix_ma, iy_ma, iz_ma in a shield; --against a classical calibration",
        offset_coil,
    ),
    Method("linear", "article 1-3 (2.2.1)", "linear calibration model, M = R W S", APPLIED, linear),
    Method("polynomial", "article 4-7 (2.2.2)", "polynomial calibration model, O_i and C_i", APPLIED, polynomial),
    Method(
        "turn_over",
        "article 2.4",
        "sensor offset and residual coil field, turned by 180° around each main axis",
        "a column turn at null field: 0 as normal, 1, 2, 3 after 180° about x, y, z",
        turn_over_log,
    ),
)


ELSEWHERE: tuple[tuple[str, str, str], ...] = (
    (
        "design flip",
        "thesis 3.4.3, fig. 3.13-3.15",
        "flipping as chopper, power of the flip circuit C V² f",
    ),
    ("design noise", "thesis 3.44-3.66, tables 3.1-3.2", "noise of the read-out electronics, brick-wall factors"),
    ("design coil", "thesis 6.2, A.1-A.6", "Helmholtz coil, uniform region, angular error"),
    ("design shield", "thesis B.1-B.5", "mu-metal box, attenuation factor of spheres and n-layer cylinders"),
    ("trajectory", "thesis 6.1; article 2.4", "rotating a constant norm field vector; LIN-60000, sinusoidal field"),
    ("imcs", "thesis 6.1, table 6.2", "indoor magnetometer calibration system, driver board, current read back"),
    ("array", "thesis 6.2, 6.3-6.9, 1.2", "calibrating a gradiometer with three wires; gradient of the field"),
    ("build, flash, verify", "thesis 6.2, fig. 6.23-6.26", "on-board solution, auto-calibration at power-up"),
    ("calibrate-over-temperature", "thesis 6.1.3.2, table 6.1", "calibrations at different temperatures, many logs"),
    (
        "characterise",
        "article 8-9, 13, table 1",
        "frequency response, noise, misalignment, outliers",
    ),
    ("add cross_field", "thesis 3.9-3.14, 3.28-3.36, 5.1", "cross-field effect of the film, flipped and not"),
    ("python: barberpole.navigation", "thesis 1.1, 1.2", "heading with declination; velocity from the gradient"),
    (
        "python: barberpole.law.supply",
        "thesis 3.15-3.26, 3.37-3.43",
        "voltage or current supply, drift of bias",
    ),
    ("python: barberpole.design.feedback", "thesis 5.1.1.2, table 5.1", "feedback loop, power dissipated"),
)
"""Command or module, equations, words of the source: the methods that are no fit of a log."""


def find_method(name: str) -> Method:
    """The method of that name. Raises InputError with the known names."""
    for method in METHODS:
        if method.name == name:
            return method
    raise InputError(must("the method", f"one of {', '.join(m.name for m in METHODS)}", repr(name)))
