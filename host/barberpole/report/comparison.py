"""A comparison as pictures: where the residual is, what it follows, its spectrum, and its map over the sphere."""

from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from barberpole import __version__
from barberpole.diagnose import Comparison, Diagnosis
from barberpole.report.page import AXIS_COLOURS, BEFORE, NOISE, Section, Table, style, write_page

DRAWN = 6  # covariates, those that the residual follows most
LISTED = 12  # patterns


def write_comparison(
    found: Comparison, path: Path, log_name: str, model: str, diagnosis: Diagnosis | None = None
) -> None:
    """Write the page of one comparison, with the diagnosis first where there is one."""
    sections = [_axes(found), _patterns(found), _curves(found), _spectrum(found), _sphere(found)]
    if diagnosis:
        sections.insert(0, _suspects(diagnosis))
    provenance = f"barberpole {__version__}\nRepeat it: barberpole compare {log_name} --model {model}"
    good = found.rms_lsb < 1.1 * found.noise_lsb
    write_page(
        path, f"{log_name} against {model.replace(',', ', ')}", _verdict(found, diagnosis), good, sections, provenance
    )


def _verdict(found: Comparison, diagnosis: Diagnosis | None) -> str:
    left = f"The model leaves {found.rms_lsb:.4g} LSB rms; the noise is {found.noise_lsb:.4g} LSB."
    return f"{diagnosis.verdict}: {left}" if diagnosis else left


def _suspects(found: Diagnosis) -> Section:
    head = ("effect", "held-out error falls by", "rms after, LSB", "cannot be told from")
    rows = [
        (s.effect, f"{100 * s.heldout_drop:.1f} %", f"{s.rms_after_lsb:.4g}", ", ".join(s.confounded_with) or "nothing")
        for s in found.suspects
    ]
    blind = f" This log cannot show {', '.join(found.cannot_be_seen)}." if found.cannot_be_seen else ""
    sentence = f"Verdict: {found.verdict}. {found.next_experiment}{blind}"
    return Section("Which effect is missing?", sentence, (), [Table(head, rows)] if rows else [])


def _axes(found: Comparison) -> Section:
    names, values = list(found.rms_by_axis_lsb), list(found.rms_by_axis_lsb.values())
    figure = go.Figure(go.Bar(x=names, y=values, marker_color=BEFORE, text=[f"{v:.4g}" for v in values]))
    note = f"noise {found.noise_lsb:.4g} LSB"
    figure.add_hline(y=found.noise_lsb, line={"color": "#000", "dash": "dot"}, annotation_text=note)
    sentence = "A bar above the dotted line is more than noise."
    return Section("How large is the residual?", sentence, [style(figure, "Residual by axis", "axis", "rms, LSB", 300)])


def _patterns(found: Comparison) -> Section:
    rows = [(p.axis, p.against, p.shape, f"{p.rms_lsb:.3g}", f"{p.p_value:.1e}") for p in found.patterns[:LISTED]]
    if not rows:
        return Section("What does it follow?", "The residual follows nothing that was logged.")
    head = ("axis", "against", "shape", "rms, LSB", "p")
    sentence = "Strongest first; p is the chance of so much in the noise found, correlation included."
    return Section("What does it follow?", sentence, (), [Table(head, rows)])


def _curves(found: Comparison) -> Section:
    """The covariates with the largest bin means, all axes in one picture each."""
    largest: dict[str, float] = {}
    for curve in found.curves:
        sized = [abs(m) / e for m, e in zip(curve.mean_lsb, curve.error_lsb, strict=True) if e > 0]
        largest[curve.against] = max(largest.get(curve.against, 0.0), max(sized, default=0.0))
    drawn = sorted(largest, key=lambda name: -largest[name])[:DRAWN]
    figures = [_curve(found, against) for against in drawn]
    sentence = "Bin means with two standard errors; what is noise scatters about zero."
    return Section("Residual against what was logged", sentence, figures)


def _curve(found: Comparison, against: str) -> go.Figure:
    figure = go.Figure()
    of_this = [c for c in found.curves if c.against == against]
    for curve, colour in zip(of_this, AXIS_COLOURS, strict=False):
        bars = {"type": "data", "array": [2 * e for e in curve.error_lsb], "thickness": 1}
        dots = {"color": colour, "size": 6}
        figure.add_trace(
            go.Scatter(x=curve.x, y=curve.mean_lsb, error_y=bars, mode="markers", marker=dots, name=curve.axis)
        )
    figure.add_hline(y=0, line={"color": NOISE, "width": 1})
    return style(figure, f"Residual against {against}", against, "residual, LSB", 300)


def _spectrum(found: Comparison) -> Section:
    figure = go.Figure()
    f = found.spectrum["f_per_sample"]
    for (axis, power), colour in zip(
        ((a, p) for a, p in found.spectrum.items() if a != "f_per_sample"), AXIS_COLOURS, strict=False
    ):
        figure.add_trace(go.Scatter(x=f, y=np.sqrt(power), mode="lines", line={"color": colour}, name=axis))
    style(figure, "Amplitude spectrum of the residual", "frequency, cycles a sample", "LSB", 300)
    figure.update_xaxes(type="log")
    figure.update_yaxes(type="log")
    sentence = "Flat is white noise; a rise to the left is drift or 1/f noise, a line is an alternating field."
    return Section("At which frequencies is it?", sentence, [figure])


def _sphere(found: Comparison) -> Section:
    axes = list(found.sphere)
    figure = make_subplots(rows=1, cols=len(axes), subplot_titles=axes, shared_yaxes=True)
    cells = [v for rows in found.sphere.values() for row in rows for v in row if v is not None]
    limit = max((abs(v) for v in cells), default=1.0)
    for column, axis in enumerate(axes, start=1):
        bands, sectors = len(found.sphere[axis]), len(found.sphere[axis][0])
        latitude = np.degrees(np.arcsin(np.linspace(-1 + 1 / bands, 1 - 1 / bands, bands)))
        longitude = np.linspace(-180 + 180 / sectors, 180 - 180 / sectors, sectors)
        colours = {
            "colorscale": "RdBu",
            "reversescale": True,
            "zmin": -limit,
            "zmax": limit,
            "colorbar": {"title": "LSB"},
        }
        heat = go.Heatmap(z=found.sphere[axis], x=longitude, y=latitude, showscale=column == len(axes), **colours)
        figure.add_trace(heat, row=1, col=column)
    style(figure, "Mean residual by direction of the field", "longitude, °", "latitude, °", 320)
    sentence = "Each cell is a direction of the field in the sensor's frame; white cells are noise or were never seen."
    return Section("In which directions is it?", sentence, [figure])
