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


def find_method(name: str) -> Method:
    """The method of that name. Raises InputError with the known names."""
    for method in METHODS:
        if method.name == name:
            return method
    raise InputError(must("the method", f"one of {', '.join(m.name for m in METHODS)}", repr(name)))
