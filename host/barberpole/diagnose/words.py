"""The shape of a dependence as half a sentence, with its size: "quadratic in the y field, +38 LSB at ±48 µT"."""

import numpy as np

from barberpole.diagnose.covariates import Covariate
from barberpole.numbers import plain

ODD = ("linear", "cubic")


def shape_in_words(covariate: Covariate, strongest: int, alone: float, weights: np.ndarray) -> str:
    """alone: weight of the strongest basis function fitted for itself; weights (d,): of all together. LSB."""
    kind, words = covariate.shapes[strongest], covariate.words
    curve = alone * covariate.basis[strongest]
    if kind == "product":
        return f"product of {words}, up to {_peak(weights @ covariate.basis)}"
    if kind == "periodic":
        period = f"{_figure(covariate.period)} {covariate.unit} a period"
        return f"periodic in {words}, {period}, {_peak(weights @ covariate.basis)}"
    if kind in ("step", "loop"):
        return f"{kind} with {words}, ±{_figure(0.5 * float(np.ptp(curve)))} LSB"
    return f"{kind} in {words}, {_power(covariate, kind, curve)}"


def _power(covariate: Covariate, kind: str, curve: np.ndarray) -> str:
    """How far a power of a covariate reaches."""
    value = np.asarray(covariate.value)
    first, last = int(np.argmin(value)), int(np.argmax(value))
    low, high = float(value[first]), float(value[last])
    if kind in ODD:
        return f"{_signed(curve[last] - curve[first])} LSB from {_figure(low)} to {_figure(high)} {covariate.unit}"
    if low < 0 < high and abs(low + high) < 0.2 * (high - low):
        return f"{_signed(_edge(curve))} LSB at ±{_figure(max(-low, high))} {covariate.unit}"
    middle = curve[int(np.argmin(np.abs(value - 0.5 * (low + high))))]
    bend = 0.5 * (curve[first] + curve[last]) - middle
    return f"{_signed(bend)} LSB at {_figure(low)} and {_figure(high)} {covariate.unit} against the middle"


def _edge(curve: np.ndarray) -> float:
    """The value of largest magnitude."""
    return float(curve[int(np.argmax(np.abs(curve)))])


def _peak(series: np.ndarray) -> str:
    return f"±{_figure(float(np.max(np.abs(series))))} LSB"


def _figure(value: float) -> str:
    """Two figures; three from 100 on, an exponent from a million on."""
    return plain(value, 3 if abs(value) >= 100 else 2)


def _signed(value: float) -> str:
    return ("+" if value >= 0 else "-") + _figure(abs(value))
