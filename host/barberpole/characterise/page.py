"""The data sheet as one HTML file: table 1's figures first, then the figures of the article for this sensor."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from barberpole.characterise.sheet import Figure, Sheet
from barberpole.report.page import AXIS_COLOURS, BEFORE, MEASURED, MODEL, Section, Table, style, write_page

MOST_POINTS = 2000  # of one trace


def write_sheet(path: Path, title: str, sheet: Sheet, provenance: str) -> None:
    """Write the page, whole or not at all."""
    sections = [_figures(sheet.figures), *_linearity(sheet), *_noise(sheet), *_response(sheet), *_courses(sheet)]
    write_page(path, title, _summary(sheet), True, sections, "\n".join((*sheet.notes, provenance)))


def _summary(sheet: Sheet) -> str:
    of = "; ".join(sheet.notes)
    return f"{len(sheet.figures)} figures from {of}." if of else "No figures."


def uncertain(value: float, stderr: float) -> str:
    """A value to the digits that its error leaves: "65.72 ± 0.03"."""
    if not np.isfinite(stderr) or stderr <= 0:
        return f"{value:.4g}"
    digits = max(0, 1 - int(np.floor(np.log10(stderr))))
    return f"{value:.{digits}f} ± {stderr:.{digits}f}"


def _figures(figures: Sequence[Figure]) -> Section:
    rows, last = [], ""
    for f in figures:
        rows.append([f.quantity if f.quantity != last else "", f.case, uncertain(f.value, f.stderr), f.unit])
        last = f.quantity
    text = "Each figure with one standard error, where the logs give one. Form of table 1 of the article."
    return Section("Data sheet", text, tables=(Table(("quantity", "", "value", "unit"), rows),))


def _linearity(sheet: Sheet) -> list[Section]:
    line = sheet.linearity
    if line is None or line.field_ut is None or line.residual_ut is None or line.polynomial_ut is None:
        return []
    shown = []
    pick = slice(None, None, max(1, line.field_ut.shape[1] // MOST_POINTS))
    for i, axis in enumerate("xyz"):
        figure = go.Figure()
        for name, left, colour in (("linear", line.residual_ut, BEFORE), ("polynomial", line.polynomial_ut, MODEL)):
            figure.add_scatter(
                x=line.field_ut[i, pick], y=1000 * left[i, pick], mode="markers", name=name, marker={"color": colour}
            )
        shown.append(style(figure, f"{axis}: residual against applied field", "field, µT", "residual, nT"))
    return [Section("Residual field", "After the linear and after the polynomial calibration (fig. 5).", shown)]


def _noise(sheet: Sheet) -> list[Section]:
    if sheet.noise is None:
        return []
    figure = go.Figure()
    for i, axis in enumerate("xyz"):
        density = sheet.noise.density[i]
        figure.add_scatter(x=sheet.noise.frequency_hz, y=density, name=axis, line={"color": AXIS_COLOURS[i]})
    style(figure, "noise spectral density", "frequency, Hz", f"density, {sheet.noise_unit}/√Hz")
    figure.update_xaxes(type="log")
    figure.update_yaxes(type="log")
    corner = sheet.noise.corner_hz
    said = f"1/f below {corner:.3g} Hz" if corner else "white over the whole band"
    return [Section("Noise at rest", f"By Welch's method (fig. 8): {said}.", (figure,))]


def _response(sheet: Sheet) -> list[Section]:
    got = sheet.response
    if got is None:
        return []
    figure = go.Figure()
    figure.add_scatter(
        x=got.frequency_hz,
        y=got.relative,
        error_y={"array": np.nan_to_num(got.stderr)},
        mode="markers+lines",
        line={"color": MEASURED},
    )
    style(figure, "relative amplitude", "frequency, Hz", "amplitude over that at the lowest frequency")
    text = "From the histograms (eq. 8-9, fig. 6); error bars: the scatter of the axes."
    return [Section("Frequency response", text, (figure,))]


def _courses(sheet: Sheet) -> list[Section]:
    shown = []
    for wanted, unit in (("sensitivity", "nT/LSB"), ("offset", "nT")):
        figure = go.Figure()
        for name, axis, one in sheet.courses:
            if name == wanted:
                colour = AXIS_COLOURS["xyz".index(axis)]
                t = np.linspace(one.temp_c.min(), one.temp_c.max(), 50)
                figure.add_scatter(x=one.temp_c, y=one.values, mode="markers", name=axis, marker={"color": colour})
                figure.add_scatter(x=t, y=one.at(t), mode="lines", showlegend=False, line={"color": colour})
        if figure.data:
            shown.append(style(figure, f"{wanted} over temperature", "temperature, °C", f"{wanted}, {unit}"))
    return (
        [Section("Temperature", "Quadratic sensitivity and linear offset (3.1, 3.2, fig. 7).", shown)] if shown else []
    )
