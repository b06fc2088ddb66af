"""The demo as one HTML file to open: the verdict, where the model failed, and the error falling."""

from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from barberpole import __version__
from barberpole.demo.story import Believed, Outcome
from barberpole.diagnose import Comparison
from barberpole.report.page import AFTER, AXIS_COLOURS, BEFORE, NOISE, Section, Table, style, write_page

SHOWN_PATTERNS = 6


def write_demo_page(outcome: Outcome, path: Path) -> None:
    """Write the page of one demo."""
    sections = [_where(outcome), _suspects(outcome), _fall(outcome), _board(outcome), _power_up(outcome)]
    provenance = (
        f"barberpole {__version__}. Log {outcome.before.session.log.sha256[:12]}, "
        f"calibrations {outcome.before.calibration.hash} and {outcome.after.calibration.hash}.\n"
        f"Repeat it: barberpole demo --hidden {outcome.hidden}"
    )
    write_page(path, "barberpole demo", _verdict(outcome), outcome.after.verification.passed, sections, provenance)


def _verdict(outcome: Outcome) -> str:
    if outcome.named is None:
        return (
            f"Nothing is missing: the model leaves {outcome.comparison.rms_lsb:.1f} LSB, "
            f"the noise is {outcome.noise_lsb:.1f} LSB."
        )
    answer = outcome.to_json()
    return (
        f"{outcome.named} was missing. With it, the error on stretches never fitted falls from "
        f"{answer['heldout_before_lsb']:.1f} to {answer['heldout_after_lsb']:.1f} LSB (noise {outcome.noise_lsb:.1f}), "
        f"and on the board from {outcome.before.rms_nt:.2f} to {outcome.after.rms_nt:.2f} nT."
    )


def _where(outcome: Outcome) -> Section:
    found = outcome.comparison
    rows = [
        (p.axis, p.against, p.shape, f"{p.rms_lsb:.3g}", f"{p.p_value:.1e}") for p in found.patterns[:SHOWN_PATTERNS]
    ]
    sentence = (
        "The residual follows what is listed; a residual that is only noise follows nothing."
        if rows
        else "The residual follows nothing that was logged: it is noise."
    )
    tables = [Table(("axis", "against", "shape", "rms, LSB", "p"), rows)] if rows else []
    return Section("Where does the model fail?", sentence, _worst_curves(found), tables)


def _worst_curves(found: Comparison) -> list[go.Figure]:
    """The residual against the covariate that it follows most, of those that can be drawn as a curve."""
    curves = {(c.axis, c.against): c for c in found.curves}
    drawn = [curves[p.axis, p.against] for p in found.patterns if (p.axis, p.against) in curves]
    if not drawn:
        return []
    curve = drawn[0]
    bars = {"type": "data", "array": [2 * e for e in curve.error_lsb], "thickness": 1}
    dots = {"color": BEFORE, "size": 8}
    figure = go.Figure(go.Scatter(x=curve.x, y=curve.mean_lsb, error_y=bars, mode="markers", marker=dots))
    figure.add_hline(y=0, line={"color": NOISE, "width": 1})
    title = f"Residual of {curve.axis} against {curve.against}: bin means with two standard errors"
    return [style(figure, title, curve.against, "residual, LSB")]


def _suspects(outcome: Outcome) -> Section:
    found = outcome.diagnosis
    rows = [
        (s.effect, f"{100 * s.heldout_drop:.1f} %", f"{s.rms_after_lsb:.4g}", ", ".join(s.confounded_with) or "nothing")
        for s in found.suspects
    ]
    head = ("effect", "held-out error falls by", "rms after, LSB", "cannot be told from")
    tables = [Table(head, rows)] if rows else []
    return Section("Which effect is missing?", f"Verdict: {found.verdict}. {found.next_experiment}", (), tables)


def _fall(outcome: Outcome) -> Section:
    answer = outcome.to_json()
    names = ["on the log", "held out"]
    bars = []
    for when, colour in (("before", BEFORE), ("after", AFTER)):
        values = [answer[f"rms_{when}_lsb"], answer[f"heldout_{when}_lsb"]]
        labels = [f"{v:.1f}" for v in values]
        bars.append(go.Bar(name=when, x=names, y=values, text=labels, textposition="auto", marker_color=colour))
    figure = go.Figure(bars)
    noise = f"noise {outcome.noise_lsb:.1f} LSB"
    figure.add_hline(y=outcome.noise_lsb, line={"color": "#000", "dash": "dot"}, annotation_text=noise)
    title = f"Error before and after adding {outcome.named}" if outcome.named else "Error of the model and the noise"
    sentence = "The dotted line is the noise that the emulated board was given: no model can go below it."
    figure = style(figure, title, "", "rms error, LSB (logarithmic)")
    figure.update_yaxes(type="log", rangemode="tozero")
    return Section("Does the error fall?", sentence, [figure])


def _board(outcome: Outcome) -> Section:
    steps = [("before", outcome.before)] + ([("after", outcome.after)] if outcome.addition else [])
    figure = make_subplots(rows=1, cols=len(steps), shared_yaxes=True, subplot_titles=[name for name, _ in steps])
    for column, (_, believed) in enumerate(steps, start=1):
        for axis, colour in enumerate(AXIS_COLOURS):
            t, error = _thinned(believed, axis)
            dots = {"color": colour, "size": 3}
            trace = go.Scatter(
                x=t,
                y=error,
                mode="markers",
                marker=dots,
                name="xyz"[axis],
                showlegend=column == 1,
                legendgroup=str(axis),
            )
            figure.add_trace(trace, row=1, col=column)
    style(figure, "Field computed on the board less field applied", "time, s", "error, nT")
    figure.update_yaxes(title_text="", col=2)
    sentence = "The board compensates each sample with the generated code and the gains it found at power-up."
    return Section("What does the board itself compute?", sentence, [figure])


def _thinned(believed: Believed, axis: int, most: int = 1500) -> tuple[np.ndarray, np.ndarray]:
    """For drawing only."""
    step = max(1, believed.error_nt.shape[1] // most)
    return believed.session.log["t_s"][::step], believed.error_nt[axis, ::step]


def _power_up(outcome: Outcome) -> Section:
    rows = [(check.sentence, "yes" if check.ok else "NO") for check in outcome.after.verification.checks]
    gains = ", ".join(f"{ppm:+.0f}" for ppm in outcome.after.gain_error_ppm)
    sentence = f"Gains against the truth after the last power-up: {gains} ppm (x, y, z)."
    return Section(
        "Does the host believe the board's self-calibration?", sentence, (), [Table(("check", "holds"), rows)]
    )
