"""The pictures of the bench: those of the report, with what a click or a box in them stands for.

They are drawn from few points and computed from all samples. Every drawn point carries the number of its sample, so
that a choice made in one picture is shown in all.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from barberpole import figures
from barberpole.diagnose.compare import map_of_sphere
from barberpole.figures.decimate import extremes
from barberpole.workbench.traces import Traces, inside

READINGS = ("x", "y", "z")
CHOSEN = "#CC79A7"  # reddish purple of the same palette
DOTS = 450  # of a panel
GIANT = 15  # one dot in so many is kept for its size
HEIGHTS = {"traces": 470, "residual": 300, "sphere": 270}


@dataclass(frozen=True)
class View:
    """What the page shows: what the residual is drawn against, the noise where it is known, light or dark."""

    against: str = "t_s"
    noise_lsb: float | None = None
    dark: bool = False


@dataclass(frozen=True)
class Box:
    """A box drawn in a picture: the x range of an abscissa, and the y range of one channel's residual.

    y_lsb None: any residual; channel None: any channel.
    """

    against: str
    x: tuple[float, float]
    y_lsb: tuple[float, float] | None = None
    channel: int | None = None


@dataclass(frozen=True)
class Picture:
    """A figure to send: plot (plotly's own form), title, sentence; samples: of each trace with choosable points."""

    plot: dict[str, Any]
    title: str
    sentence: str
    samples: dict[int, np.ndarray] = field(default_factory=dict, repr=False)


@dataclass(frozen=True)
class Chosen:
    """Samples within a box: how many, and by picture and trace which of the drawn points."""

    samples: int
    points: dict[str, dict[int, list[int]]]


def draw(traces: Traces, view: View, wanted: Sequence[str]) -> dict[str, Picture]:
    """The pictures asked for, by name."""
    makers = {"traces": _traces, "residual": _residual, "sphere": _sphere}
    return {name: makers[name](traces, view) for name in wanted}


def _traces(traces: Traces, view: View) -> Picture:
    at = traces.abscissae["t_s"]
    figure = figures.traces(at.values, traces.measured, traces.modelled, READINGS, t_name=at.title)
    samples = {}
    for number, trace in enumerate(_drawn(figure)):
        if trace.mode == "markers":
            axis = int((trace.yaxis or "y")[1:] or 1) - 1
            samples[number] = extremes(traces.measured[axis])
    figure.plot.update_layout(height=HEIGHTS["traces"], selectdirection="h")
    return _sent(figure, view, samples)


def _drawn(figure: figures.Figure) -> Sequence[Any]:
    return list(figure.plot.select_traces())


def _residual(traces: Traces, view: View) -> Picture:
    against = traces.abscissae[view.against]
    figure = figures.residual_against(
        traces.residual, against.values, against.title, traces.axes, noise_lsb=view.noise_lsb
    )
    samples = {i: np.asarray(t.customdata) for i, t in enumerate(_drawn(figure)) if t.customdata is not None}
    figure.plot.update_layout(height=HEIGHTS["residual"])
    return _sent(figure, view, samples)


def _sphere(traces: Traces, view: View) -> Picture:
    figure = figures.sphere(map_of_sphere(traces.field_ut, traces.residual, traces.axes))
    figure.plot.update_layout(height=HEIGHTS["sphere"], dragmode=False)
    return _sent(figure, view, {})


def _sent(figure: figures.Figure, view: View, samples: dict[int, np.ndarray]) -> Picture:
    """The figure as it goes to the page, which is as wide as it happens to be and keeps its zoom."""
    plot = figure.on(view.dark).plot
    samples = {number: _thinned(plot.data[number], at) for number, at in samples.items()}
    plot.update_layout(autosize=True, uirevision="kept", newselection={"line": {"width": 1.5, "dash": "dot"}})
    if samples:
        plot.update_layout(dragmode="select")
        plot.update_traces(
            selected={"marker": {"opacity": 1.0, "color": CHOSEN, "size": 6}},
            unselected={"marker": {"opacity": 0.25}},
            selector={"mode": "markers"},
        )
    return Picture(plot.to_plotly_json() | {"config": figures.CONFIG}, figure.title, figure.sentence, samples)


def _thinned(trace: Any, samples: np.ndarray) -> np.ndarray:
    """Fewer dots, the largest kept: a browser redraws each of them at every click. Their samples."""
    if samples.size <= DOTS:
        return samples
    size = np.abs(np.asarray(trace.y, float))
    giants = np.argpartition(size, size.size - DOTS // GIANT)[size.size - DOTS // GIANT :]
    even = (np.arange(DOTS) * (size.size / DOTS)).astype(int)
    at = np.union1d(even, giants)
    trace.x, trace.y = np.asarray(trace.x)[at], np.asarray(trace.y)[at]
    if trace.customdata is not None:
        trace.customdata = np.asarray(trace.customdata)[at]
    return samples[at]


def choose(traces: Traces, box: Box, drawn: dict[str, Picture]) -> Chosen:
    """What is within a box, in every picture drawn."""
    mask = inside(traces, box.against, box.x, box.y_lsb, box.channel)
    points = {
        name: {number: np.flatnonzero(mask[at]).tolist() for number, at in picture.samples.items()}
        for name, picture in drawn.items()
        if picture.samples
    }
    return Chosen(int(mask.sum()), points)
