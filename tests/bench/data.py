"""What is measured on: a turned sensor with crooked axes, and with temperature, cross-field and converter."""

import numpy as np
from barberpole.effects import Conditions, Setup
from barberpole.methods.ellipsoid import Ellipsoid, cramer_rao
from barberpole.model import compose
from barberpole.observations import Observations

FIELD_UT, NOISE_LSB = 50.0, 0.3
MATRIX = np.array([[3.0, 0.03, -0.03], [0.0, 3.3, 0.03], [0.0, 0.0, 2.7]])
OFFSET = np.array([30.0, -20.0, 10.0])
LADDER = ("bias", "scale", "misalignment", "sensitivity_temperature", "bias_temperature", "cross_field", "adc_inl")
TRUTH = {
    "bias": (120.0, -80.0, 40.0),
    "scale": (10.0, 10.5, 9.6),
    "misalignment": (0.01, -0.02, 0.015, 0.005, 0.01, -0.01),
    "sensitivity_temperature": (1e-3, 2e-3, -1e-3),
    "bias_temperature": (0.3, -0.2, 0.1),
    "cross_field": (1 / 800, 1 / 700, 1 / 900),
    "adc_inl": (2e-3, 1e-3, -1e-3, 1e-6, 2e-6, 0.0, 0.0, 0.0, 0.0),
}


def turned(n: int, reference: str, seed: int = 1) -> Observations:
    """n readings in 50 µT with 0.1 µT of noise, temperature up and down."""
    rng = np.random.default_rng(seed)
    b = _directions(rng, n)
    y = MATRIX @ b + OFFSET[:, None] + NOISE_LSB * rng.normal(size=b.shape)
    return _seen(y, b, reference)


def ladder(n: int) -> Observations:
    """Readings of LADDER at TRUTH with 1 LSB (0.1 µT) of noise."""
    rng = np.random.default_rng(3)
    b = _directions(rng, n)
    model = compose(LADDER, Setup(lsb_per_ut=10.0, span_ut=75.0))
    p = np.concatenate([TRUTH[t.effect.name] for t in model.terms])
    seen = _seen(np.zeros_like(b), b, "vector")
    return _seen(model.predict(b, p, seen.at) + rng.normal(size=b.shape), b, "vector")


def over_the_bound(upper: np.ndarray, centre: np.ndarray, seed: int, n: int) -> float:
    """Squared error of |H| = 50, H = upper (h - centre), in units of the Cramér-Rao bound; 1 for the best."""
    inverse, corner = np.linalg.inv(MATRIX), np.triu_indices(3)
    true = np.linalg.cholesky(inverse.T @ inverse).T
    found = np.linalg.cholesky(upper.T @ upper).T
    apart = np.append(found[corner] - true[corner], centre - OFFSET)
    bound = cramer_rao(turned(n, "constant", seed).y, Ellipsoid(true, OFFSET), FIELD_UT, NOISE_LSB)
    return float(apart @ np.linalg.solve(bound, apart)) / 9.0


def _directions(rng: np.random.Generator, n: int) -> np.ndarray:
    b = rng.normal(size=(3, n))
    return b * (FIELD_UT / np.linalg.norm(b, axis=0))


def _seen(y: np.ndarray, b: np.ndarray, reference: str) -> Observations:
    n = y.shape[1]
    at = Conditions(state=np.zeros(n), t_s=np.arange(n) / 100.0, temp_c=25.0 + 15.0 * np.sin(np.arange(n) * 20.0 / n))
    return Observations(y, at, b if reference == "vector" else None, None, np.arange(n), reference, False)
