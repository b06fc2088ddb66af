"""The data sheet as one HTML file: table 1's figures first, then the figures of the article for this sensor."""

from collections.abc import Sequence
from pathlib import Path

from barberpole.characterise.sheet import Figure, Sheet
from barberpole.figures.sheet import density, over_temperature, residual_fields, response
from barberpole.numbers import uncertain
from barberpole.report.page import Section, Table, write_page


def write_sheet(path: Path, title: str, sheet: Sheet, provenance: str) -> None:
    """Write the page, whole or not at all."""
    sections = [_figures(sheet.figures), *_linearity(sheet), *_noise(sheet), *_response(sheet), *_courses(sheet)]
    write_page(path, title, _summary(sheet), "good", sections, "\n".join((*sheet.notes, provenance)))


def _summary(sheet: Sheet) -> str:
    of = "; ".join(sheet.notes)
    return f"{len(sheet.figures)} figures from {of}." if of else "No figures."


def _figures(figures: Sequence[Figure]) -> Section:
    rows, last = [], ""
    for f in figures:
        rows.append([f.quantity if f.quantity != last else "", f.case, uncertain(f.value, f.stderr), f.unit])
        last = f.quantity
    text = "Each figure with one standard error, where the logs give one. Form of table 1 of the article."
    return Section("Data sheet", text, tables=(Table(("quantity", "", "value", "unit"), rows),))


def _linearity(sheet: Sheet) -> list[Section]:
    drawn = residual_fields(sheet.linearity) if sheet.linearity else None
    said = "After the linear and after the polynomial calibration (fig. 5)."
    return [Section("Residual field", said, [drawn])] if drawn else []


def _noise(sheet: Sheet) -> list[Section]:
    if sheet.noise is None:
        return []
    return [Section("Noise at rest", "By Welch's method (fig. 8).", [density(sheet.noise, sheet.noise_unit)])]


def _response(sheet: Sheet) -> list[Section]:
    if sheet.response is None:
        return []
    return [Section("Frequency response", "From the histograms (eq. 8-9, fig. 6).", [response(sheet.response)])]


def _courses(sheet: Sheet) -> list[Section]:
    shown = []
    for wanted, unit in (("sensitivity", "nT/LSB"), ("offset", "nT")):
        courses = [(axis, one) for name, axis, one in sheet.courses if name == wanted]
        if courses:
            shown.append(over_temperature(wanted, courses, unit))
    text = "Quadratic sensitivity and linear offset (3.1, 3.2, fig. 7)."
    return [Section("Temperature", text, shown)] if shown else []
