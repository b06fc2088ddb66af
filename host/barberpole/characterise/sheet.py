"""One sensor's data sheet from its logs, in the form of the article's table 1, each figure with its uncertainty."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from barberpole.characterise.angles import noise_angle_deg
from barberpole.characterise.kinds import Sorted, sort_logs
from barberpole.characterise.linearity import Linearity, linearity, temperature_courses
from barberpole.characterise.noise import NoiseFigures, noise_figures
from barberpole.characterise.response import Response, bandwidth_hz
from barberpole.characterise.temperature import Course, Thermometer, thermometer
from barberpole.characterise.tones import amplitudes
from barberpole.log import Log
from barberpole.methods.turn_over import turn_over

EQUATOR_NT, ORBIT_NT = 30_000.0, 16_000.0  # article table 1: B at the equator, and its least at 800 km
AXES = "xyz"
INTERNAL = "temp_lsb"  # column of the chip's own thermometer
AT_C = 25.0  # where drifts are quoted


@dataclass(frozen=True)
class Figure:
    """One line of the sheet: stderr NaN where there is none."""

    quantity: str
    case: str
    value: float
    stderr: float
    unit: str


@dataclass(frozen=True)
class Sheet:
    """The figures, and what the page draws: linearity, noise in nT, response, courses of sensitivity and offset."""

    figures: tuple[Figure, ...]
    notes: tuple[str, ...]
    linearity: Linearity | None = None
    noise: NoiseFigures | None = None
    noise_unit: str = "nT"
    response: Response | None = None
    courses: tuple[tuple[str, str, Course], ...] = ()


@dataclass
class _Found:
    figures: list[Figure] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add(self, quantity: str, case: str, value: float, stderr: float, unit: str) -> None:
        self.figures.append(Figure(quantity, case, float(value), float(stderr), unit))

    def axes(self, quantity: str, values, stderrs, unit: str) -> None:
        for i, axis in enumerate(AXES):
            self.add(quantity, axis, values[i], np.broadcast_to(stderrs, 3)[i], unit)


def make_sheet(logs: Sequence[Log]) -> Sheet:
    """The sheet of one sensor. Raises InputError where a log is of no kind that says anything."""
    of = sort_logs(logs)
    found = _Found([], list(of.notes))
    line = linearity(of)
    if line:
        _linear_figures(found, line)
    noise, unit = _noise(found, of, line)
    response = _response(found, of, noise, line)
    courses = temperature_courses(of)
    _drifts(found, courses)
    _turn_over(found, of, line)
    _thermometer(found, logs)
    return Sheet(tuple(found.figures), tuple(found.notes), line, noise, unit, response, courses)


def _linear_figures(found: _Found, line: Linearity) -> None:
    """Sensitivity, misalignment, offset, and what is left of field and direction."""
    found.axes("linear sensitivity", line.sensitivity_nt, line.sensitivity_stderr_nt, "nT/LSB")
    for k, pair in enumerate(("x-y", "x-z", "y-z")):
        found.add("misalignment angle", pair, line.angle_deg[k], line.angle_stderr_deg[k], "°")
    found.add("misalignment angle", "maximum", np.max(np.abs(line.angle_deg)), np.nan, "°")
    found.axes("offset", line.offset_nt, line.offset_stderr_nt, "nT")
    for name, value, unit in line.errors:
        found.add(name, "rms", value, np.nan, unit)
    found.notes.extend(line.notes)


def _noise(found: _Found, of: Sorted, line: Linearity | None) -> tuple[NoiseFigures | None, str]:
    if not of.rest:
        return None, ""
    log = max(of.rest, key=lambda one: one.n)
    y, unit = of.readings(log), "LSB"
    figures = noise_figures(y, of.rate_hz(log))
    if line:
        figures, unit = figures.scaled(line.sensitivity_nt), "nT"
    found.axes("noise standard deviation", figures.std, figures.std_stderr, unit)
    found.axes("noise density at 1 Hz", figures.at_1_hz, figures.at_1_hz_stderr, f"{unit}/√Hz")
    found.axes("white noise density", figures.white, np.nan, f"{unit}/√Hz")
    found.add("corner of the 1/f noise", "all", figures.corner_hz, np.nan, "Hz")
    found.axes("outlier rate", 1e6 * figures.outliers, 1e6 * figures.outlier_stderr(y.shape[1]), "ppm")
    if line:
        xy, z = float(np.mean(figures.std[:2])), float(figures.std[2])
        relative = float(np.mean(figures.std_stderr / figures.std))
        for field_nt in (EQUATOR_NT, ORBIT_NT):
            angle = noise_angle_deg(xy, z, field_nt)
            found.add("alignment uncertainty by noise", f"B = {field_nt:.0f} nT", angle, angle * relative, "°")
    return figures, unit


def _response(found: _Found, of: Sorted, noise: NoiseFigures | None, line: Linearity | None) -> Response | None:
    sigma = None if noise is None else noise.std / (line.sensitivity_nt if line else 1.0)
    found_response = amplitudes(of, sigma)
    if found_response is None:
        return None
    for f, relative, error in zip(
        found_response.frequency_hz, found_response.relative, found_response.stderr, strict=True
    ):
        found.add("relative amplitude", f"{f:.3g} Hz", relative, error, "1")
    last = bandwidth_hz(float(found_response.frequency_hz[-1]), float(found_response.relative[-1]))
    found.add("3 dB bandwidth, first order", "from the last", last, np.nan, "Hz")
    return found_response


def _drifts(found: _Found, courses: Sequence[tuple[str, str, Course]]) -> None:
    for name, axis, one in courses:
        drift, error = one.drift(AT_C)
        if name == "sensitivity":
            found.add("sensitivity drift at 25 °C", axis, 1000.0 * drift, 1000.0 * error, "pT/LSB/K")
            found.add("sensitivity drift, slope", axis, 2000.0 * one.coefficients[2], np.nan, "pT/LSB/K²")
        else:
            found.add("offset drift", axis, drift, error, "nT/K")


def _turn_over(found: _Found, of: Sorted, line: Linearity | None) -> None:
    for log in of.turned_over:
        got = turn_over(of.readings(log), log["turn"])
        scale, unit = (line.sensitivity_nt, "nT") if line else (np.ones(3), "LSB")
        found.axes("offset by turn-over", got.offset * scale, got.stderr * scale, unit)
        found.axes("residual field by turn-over", got.residual * scale, got.stderr * scale, unit)


def _thermometer(found: _Found, logs: Sequence[Log]) -> None:
    with_both = [log for log in logs if log.has(INTERNAL, "temp_c")]
    if not with_both:
        return
    reading = np.concatenate([log[INTERNAL] for log in with_both])
    got: Thermometer = thermometer(reading, np.concatenate([log["temp_c"] for log in with_both]))
    found.add("internal thermometer, slope", "all", got.c_per_lsb, got.stderr_c_per_lsb, "°C/LSB")
    found.add("internal thermometer, at 0 LSB", "all", got.offset_c, np.nan, "°C")
    found.add("internal thermometer, residual", "rms", got.rms_c, np.nan, "K")
