"""Sensitivity and offset against temperature (article 3.1, 3.2, fig. 7), and the chip's own thermometer (fig. 4).

S(T) = s_0 + s_1 T + s_2 T²,   drift dS/dT = s_1 + 2 s_2 T                        (3.1)
B_off(T) = b_0 + b_1 T,        drift b_1                                         (3.2)
"""

from dataclasses import dataclass

import numpy as np

from barberpole.errors import InputError, must

SENSITIVITY_DEGREE, OFFSET_DEGREE = 2, 1


@dataclass(frozen=True)
class Course:
    """A polynomial of T in °C, coefficients (degree + 1,) lowest first, with covariance and determination R²."""

    coefficients: np.ndarray
    covariance: np.ndarray
    r_squared: float
    temp_c: np.ndarray
    values: np.ndarray

    def at(self, temp_c: np.ndarray | float) -> np.ndarray:
        """The value at a temperature."""
        return np.asarray(np.polynomial.polynomial.polyval(temp_c, self.coefficients))

    def drift(self, temp_c: float) -> tuple[float, float]:
        """d/dT at a temperature, with its standard error, per kelvin."""
        powers = np.arange(1, len(self.coefficients))
        row = np.concatenate([[0.0], powers * float(temp_c) ** (powers - 1)])
        return float(row @ self.coefficients), float(np.sqrt(max(row @ self.covariance @ row, 0.0)))


def course(temp_c: np.ndarray, values: np.ndarray, degree: int) -> Course:
    """Least-squares polynomial through values (k,) at temperatures (k,).

    Raises InputError with too few different temperatures for the degree.
    """
    distinct = len(np.unique(np.round(temp_c, 1)))
    if distinct < degree + 2:
        wanted = f"given at least {degree + 2} different temperatures"
        raise InputError(must(f"a drift of degree {degree}", wanted, f"{distinct}"))
    middle = float(np.mean(temp_c))
    columns = np.vander(temp_c - middle, degree + 1, increasing=True)
    solved, *_ = np.linalg.lstsq(columns, values, rcond=None)
    left = values - columns @ solved
    variance = float(left @ left) / max(len(values) - degree - 1, 1)
    shift = _shift(middle, degree)
    covariance = shift @ (variance * np.linalg.inv(columns.T @ columns)) @ shift.T
    about = values - values.mean()
    r_squared = 1.0 - float(left @ left) / max(float(about @ about), 1e-300)
    return Course(shift @ solved, covariance, r_squared, temp_c, values)


def _shift(middle: float, degree: int) -> np.ndarray:
    """Matrix from coefficients in T - middle to coefficients in T."""
    out = np.zeros((degree + 1, degree + 1))
    for power in range(degree + 1):
        out[: power + 1, power] = np.polynomial.polynomial.polypow([-middle, 1.0], power)
    return out


@dataclass(frozen=True)
class Thermometer:
    """T = offset_c + c_per_lsb x reading, with the rms of what is left in K."""

    offset_c: float
    c_per_lsb: float
    stderr_c_per_lsb: float
    rms_c: float


def thermometer(reading_lsb: np.ndarray, temp_c: np.ndarray) -> Thermometer:
    """The chip's own temperature sensor against one beside it, linear (fig. 4). InputError where it stands still."""
    found = np.unique(reading_lsb)
    if len(found) < 3:
        raise InputError(must("the thermometer's readings", "at three or more levels", f"{len(found)}"))
    columns = np.vstack([np.ones_like(reading_lsb), reading_lsb]).T
    solved, *_ = np.linalg.lstsq(columns, temp_c, rcond=None)
    left = temp_c - columns @ solved
    variance = float(left @ left) / max(len(temp_c) - 2, 1)
    stderr = float(np.sqrt(variance * np.linalg.inv(columns.T @ columns)[1, 1]))
    return Thermometer(float(solved[0]), float(solved[1]), stderr, float(np.sqrt(np.mean(left**2))))
