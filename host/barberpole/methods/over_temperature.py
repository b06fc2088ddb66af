"""Calibrations at several temperatures, and polynomials through them (thesis 6.1.3.2, fig. 6.17-6.19, table 6.1).

    H = A(T) h + B(T)                                                                (4.5)
    B_i(T) quadratic, A_ij(T) cubic in u = T - T_0

A is upper triangular (4.18) in µT/LSB, B in µT; T_0 the mean of the temperatures. What is left beside the polynomials
is the residual error of table 6.1: of A in ppm of the mean diagonal, of B in nT. Both drift formulas of the article
(3.1, 3.2) are derivatives of such polynomials.
"""

from dataclasses import dataclass

import numpy as np

from barberpole.errors import InputError, must
from barberpole.fit.ellipsoid import Ellipsoid
from barberpole.methods.answer import Values, value

DEGREE_B, DEGREE_A = 2, 3
ELEMENTS = tuple((i, j) for i in range(3) for j in range(i, 3))


@dataclass(frozen=True)
class OverTemperature:
    """Polynomials in u = T - t0_c, lowest power first: bias (3, 3) in µT, scale (6, 4) in µT/LSB.

    temp_c (k,); residuals bias_left_ut (3, k) and scale_left (6, k), the latter relative to the mean diagonal of A.
    """

    t0_c: float
    temp_c: np.ndarray
    bias: np.ndarray
    scale: np.ndarray
    bias_left_ut: np.ndarray
    scale_left: np.ndarray

    def at(self, temp_c: float) -> tuple[np.ndarray, np.ndarray]:
        """A (3, 3) and B (3,) at a temperature, by eq. 4.5."""
        a, b = self.each(np.array([temp_c]))
        return a[:, :, 0], b[:, 0]

    def each(self, temp_c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A (3, 3, n) and B (3, n) at temperatures (n,)."""
        u = temp_c - self.t0_c
        a = np.zeros((3, 3, u.size))
        for (i, j), p in zip(ELEMENTS, self.scale, strict=True):
            a[i, j] = np.polynomial.polynomial.polyval(u, p)
        return a, np.asarray(np.polynomial.polynomial.polyval(u, self.bias.T))


def over_temperature(temp_c: np.ndarray, shapes: list[Ellipsoid]) -> OverTemperature:
    """Polynomials through k calibrations at temperatures (k,). Raises InputError with fewer than five of them."""
    if len(np.unique(np.round(temp_c, 1))) <= DEGREE_A + 1:
        wanted = f"at least {DEGREE_A + 2} different temperatures for a cubic and something to judge it by"
        raise InputError(must("the logs", wanted, ", ".join(f"{t:.1f} °C" for t in temp_c)))
    t0 = float(np.mean(temp_c))
    u = temp_c - t0
    elements = np.array([[s.upper[i, j] for s in shapes] for i, j in ELEMENTS])
    biases = -np.array([s.upper @ s.centre for s in shapes]).T
    bias, bias_left = _fit(u, biases, DEGREE_B)
    scale, scale_left = _fit(u, elements, DEGREE_A)
    level = float(np.mean([elements[ELEMENTS.index((i, i))].mean() for i in range(3)]))
    return OverTemperature(t0, temp_c, bias, scale, bias_left, scale_left / level)


def _fit(u: np.ndarray, values: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (m, degree + 1), lowest first, and what is left (m, k)."""
    columns = np.vander(u / max(np.ptp(u), 1e-9), degree + 1, increasing=True)
    solved = np.linalg.lstsq(columns, values.T, rcond=None)[0]
    return (solved / max(np.ptp(u), 1e-9) ** np.arange(degree + 1)[:, None]).T, values - (columns @ solved).T


def values_of(found: OverTemperature) -> Values:
    """The table: coefficients, then the residual errors in the units of table 6.1."""
    out = {"t0": value(found.t0_c, np.nan, "degC")}
    for i, p in enumerate(found.bias):
        out |= {f"b_{'xyz'[i]}.{k}": value(c, np.nan, _per("uT", k)) for k, c in enumerate(p)}
    for (i, j), p in zip(ELEMENTS, found.scale, strict=True):
        out |= {f"a_{i + 1}{j + 1}.{k}": value(c, np.nan, _per("uT/LSB", k)) for k, c in enumerate(p)}
    for i, left in enumerate(found.bias_left_ut):
        out[f"residual.b_{'xyz'[i]}"] = value(1000.0 * np.max(np.abs(left)), np.nan, "nT")
    for (i, j), left in zip(ELEMENTS, found.scale_left, strict=True):
        out[f"residual.a_{i + 1}{j + 1}"] = value(1e6 * np.max(np.abs(left)), np.nan, "ppm")
    return out


def _per(unit: str, power: int) -> str:
    return unit if power == 0 else f"{unit}/K" if power == 1 else f"{unit}/K^{power}"
