"""Thesis chapter 4 and 6.1: error model, sharpness of the two-step ellipsoid, K at the site, runs over temperature."""

from datetime import date
from functools import partial

import numpy as np

from barberpole.board import load_sensor
from barberpole.fit.ellipsoid import Ellipsoid
from barberpole.methods.ellipsoid import algebraic, cramer_rao, efficient
from barberpole.methods.over_temperature import ELEMENTS, over_temperature
from barberpole.navigation.geomagnetic import geomagnetic_magnitude_ut
from barberpole.reproduce.row import Row
from barberpole.trajectory.shapes import GOLDEN_ANGLE, direction

_row = partial(Row, "thesis")

SITE = (48.0 + 43.0 / 60.0 + 17.42 / 3600.0, 2.0 + 12.0 / 60.0 + 33.26 / 3600.0)  # 6.1.3.2
MEASURED = date(2012, 6, 1)  # the thesis is of 2013; the field there drifts by 0.05 µT a year
PEAK_UT, ANISOTROPY_UT = 1.28, 900.0  # fig. 5.15, eq. 5.13
S_F, S_M = np.diag([1.04, 0.97, 1.01]), np.array([[1.0, 0.02, -0.03], [0.0, 1.0, 0.01], [0.0, 0.0, 1.0]])  # ours
S_SI = np.array([[1.02, 0.01, -0.02], [0.01, 0.99, 0.015], [0.0, -0.01, 1.01]])
B_HI, B_S = np.array([4.0, -7.0, 2.0]), np.array([1.0, 3.0, -2.0])
K_UT, SIGMA_UT = 50.0, 0.1
TRUE = Ellipsoid(np.array([[1.02, 0.03, -0.02], [0.0, 0.97, 0.04], [0.0, 0.0, 1.05]]), np.array([12.0, -7.0, 20.0]))
UPPER = np.triu_indices(3)
RUN_S, RUN_POINTS = 180.0, 264  # 6.1.3.2: three minutes a calibration
TEMPS_C = np.linspace(0.0, 45.0, 10)
PRINTED_B_NT = (2.0, 1.3, 4.5)  # table 6.1, IMCS
PRINTED_A_PPM = {(0, 0): 250.0, (0, 1): 450.0, (0, 2): 140.0, (1, 1): 350.0, (1, 2): 130.0, (2, 2): 220.0}


def rows() -> list[Row]:
    """All of them, in the order of the thesis."""
    return [*_model(), *_sharpness(), _site(), *_over_temperature()]


def _sphere(n: int) -> np.ndarray:
    """(3, n) unit vectors along a golden spiral."""
    k = np.arange(n)
    return direction(np.arcsin(1.0 - (2.0 * k + 1.0) / n), k * GOLDEN_ANGLE)


def _model() -> list[Row]:
    """4.1-4.7, 4.17: readings bent by all of them, and what the ellipsoid makes of them."""
    a, b = S_F @ S_M @ S_SI, B_S + S_F @ S_M @ B_HI
    field = K_UT * _sphere(400)
    shape = algebraic(np.linalg.solve(a, field - b[:, None]), K_UT)
    square = float(np.max(np.abs(shape.upper.T @ shape.upper - a.T @ a)) < 1e-9)
    centre = float(np.max(np.abs(shape.centre + np.linalg.solve(a, b))) < 1e-9)
    return [
        _row("eq. 4.1-4.6, 4.17", "LᵀL equals AᵀA within 1e-9, A = S_f S_m S_si", 1.0, square, "", "without noise"),
        _row("eq. 4.7, 4.9", "b equals −A⁻¹B within 1e-9, B = B_s + S_f S_m B_hi", 1.0, centre, "", "without noise"),
    ]


def _sharpness() -> list[Row]:
    """Error over the Cramér-Rao bound: at most one and the distance from the best estimate, in standard errors."""
    out = []
    for n in (10_000, 200_000):
        rng = np.random.default_rng(n)
        field, noise = K_UT * _sphere(n), SIGMA_UT * rng.normal(size=(3, n))
        clean = np.linalg.solve(TRUE.upper, field) + TRUE.centre[:, None]
        white = np.linalg.cholesky(np.linalg.inv(cramer_rao(clean, TRUE, K_UT, SIGMA_UT))).T
        best = _vector(TRUE) + _best(field, noise)
        apart = [white @ (_vector(fit(clean + noise, K_UT)) - best) for fit in (efficient, algebraic)]
        over = [1.0 + float(np.sqrt(np.mean(np.square(d)))) for d in apart]
        what = f"error over the Cramér-Rao bound, at most, {n} samples at σ/K = {SIGMA_UT / K_UT:g}"
        remark = "simulated; with the steps after 4.19, which take off its bias of order σ²/K"
        out.append(_row("eq. 4.8-4.20", what, None, over[0], "", remark))
        out.append(_row("eq. 4.19", f"{what}, by the least squares alone", None, over[1], "", "simulated"))
    return out


def _vector(shape: Ellipsoid) -> np.ndarray:
    return np.concatenate([shape.upper[UPPER], shape.centre])


def _best(field: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Error (9,) of the efficient estimate to first order in this very noise: it has the Cramér-Rao covariance."""
    g = TRUE.upper.T @ (field / K_UT)
    size = np.linalg.norm(g, axis=0)
    u = np.linalg.solve(TRUE.upper, field)
    columns = np.stack([field[i] / K_UT * u[j] / size for i, j in zip(*UPPER, strict=True)] + list(-g / size))
    return -np.linalg.solve(columns @ columns.T, columns @ (np.sum(g * noise, axis=0) / size))


def _site() -> Row:
    found = geomagnetic_magnitude_ut(*SITE, 0.16, MEASURED)
    implied = float(np.sqrt(2.0 * ANISOTROPY_UT * PEAK_UT))
    remark = f"IGRF at the printed place, 2012; the 1.28 µT of fig. 5.15 imply {implied:.1f} by B²/(2 H_k) at 9 Oe"
    return _row("eq. 4.8, 6.1.3.2", "K from the geomagnetic model", None, found, "µT", remark)


def _over_temperature() -> list[Row]:
    """Table 6.1: what ten runs of three minutes with the noise of the sensor file leave beside the polynomials."""
    sensor = load_sensor("hmc1021_1022")
    rng = np.random.default_rng(11)
    sigma_ut = 1e-3 * sensor.noise_nt_per_rthz / np.sqrt(2.0 * RUN_S / RUN_POINTS)
    field = K_UT * _sphere(RUN_POINTS)
    shapes = []
    for t in TEMPS_C - 25.0:
        gain = 1.0 + sensor.sensitivity_tempco_per_c * t
        offset = np.array([1.0, -0.6, 0.8])[:, None] * (1.0 + sensor.bridge_tempco_per_c * t)
        y = gain * np.linalg.solve(TRUE.upper, field) + offset + sigma_ut * rng.normal(size=field.shape)
        shapes.append(efficient(y, K_UT))
    found = over_temperature(TEMPS_C, shapes)
    how = f"simulated: ten temperatures, {RUN_S:g} s each, the sensor's noise alone; printed {{:g}} {{}} of real coils"
    bias = 1000.0 * np.max(np.abs(found.bias_left_ut), axis=1)
    scale = 1e6 * np.max(np.abs(found.scale_left), axis=1)
    return [
        *(_row("table 6.1", f"residual error of b_{axis}", None, float(v), "nT", how.format(p, "nT"))
          for axis, v, p in zip("xyz", bias, PRINTED_B_NT, strict=True)),
        *(_row("table 6.1", f"residual error of a_{i + 1}{j + 1}", None, float(v), "ppm",
               how.format(PRINTED_A_PPM[i, j], "ppm")) for (i, j), v in zip(ELEMENTS, scale, strict=True)),
    ]  # fmt: skip
