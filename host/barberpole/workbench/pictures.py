"""The pictures of the bench: those of the report, with what a click or a box in them stands for.

They are drawn from few points and computed from all samples. Every drawn point carries the number of its sample, so
that a choice made in one picture is shown in all.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from barberpole import figures
from barberpole.diagnose.compare import map_of_sphere
from barberpole.figures.decimate import extremes
from barberpole.workbench.traces import Traces, inside

READINGS = ("x", "y", "z")
CHOSEN = "#CC79A7"  # reddish purple of the same palette
DOTS = 400  # of a panel: a browser redraws each of them at every click
TEMPLATES = {False: figures.LIGHT.to_plotly_json(), True: figures.DARK.to_plotly_json()}
COMBINED = "The products are combined as each residual follows them: what they explain lies on the diagonal."
CHOOSABLE = ("traces", "residual")  # pictures in which a box may be drawn
HEIGHTS = {"traces": 470, "residual": 300, "sphere": 270}


@dataclass(frozen=True)
class View:
    """What the page shows: what the residual is drawn against, the noise where it is known, light or dark."""

    against: str = "t_s"
    noise_lsb: float | None = None
    dark: bool = False

    def of(self, name: str) -> "View":
        """As far as it matters to one picture."""
        return self if name == "residual" else View(dark=self.dark)


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


def draw(traces: Traces, view: View, name: str) -> Picture:
    """The picture of that name."""
    return {"traces": _traces, "residual": _residual, "sphere": _sphere}[name](traces, view)


def _traces(traces: Traces, view: View) -> Picture:
    at = traces.abscissae["t_s"]
    figure = figures.traces(at.values, traces.measured, traces.modelled, READINGS, t_name=at.title, dots=DOTS)
    samples, markers = {}, [n for n, trace in enumerate(_drawn(figure)) if trace.mode == "markers"]
    for axis, number in enumerate(markers):
        samples[number] = extremes(traces.measured[axis], DOTS)
    return _sent(figure, view, samples, height=HEIGHTS["traces"], selectdirection="h")


def _drawn(figure: figures.Figure) -> Sequence[Any]:
    return list(figure.plot.select_traces())


def _residual(traces: Traces, view: View) -> Picture:
    against = traces.abscissae[view.against]
    figure = figures.residual_against(
        traces.residual, against.values, against.title, traces.axes, noise_lsb=view.noise_lsb, dots=DOTS
    )
    samples = {i: np.asarray(t.customdata) for i, t in enumerate(_drawn(figure)) if t.customdata is not None}
    if against.product:
        figure = replace(figure, sentence=f"{figure.sentence} {COMBINED}")
    return _sent(figure, view, samples, height=HEIGHTS["residual"])


def _sphere(traces: Traces, view: View) -> Picture:
    figure = figures.sphere(map_of_sphere(traces.field_ut, traces.residual, traces.axes))
    return _sent(figure, view, {}, height=HEIGHTS["sphere"], dragmode=False)


def _sent(figure: figures.Figure, view: View, samples: dict[int, np.ndarray], **layout: Any) -> Picture:
    """The figure as it goes to the page, which is as wide as it happens to be and keeps its zoom.

    Plain values from here on: plotly would check them all again.
    """
    plot = figure.plot.to_plotly_json()
    plot["layout"] |= {"template": TEMPLATES[view.dark], "autosize": True, "uirevision": "kept"} | layout
    plot["layout"]["newselection"] = {"line": {"width": 1.5, "dash": "dot"}}
    if samples:
        plot["layout"]["dragmode"] = "select"
    for number in samples:
        trace = plot["data"][number]
        trace.pop("customdata", None)
        trace["selected"] = {"marker": {"opacity": 1.0, "color": CHOSEN, "size": 6}}
        trace["unselected"] = {"marker": {"opacity": 0.25}}
    return Picture(plot | {"config": figures.CONFIG}, figure.title, figure.sentence, samples)


def choose(traces: Traces, box: Box, drawn: dict[str, Picture]) -> Chosen:
    """What is within a box, in every picture drawn."""
    mask = inside(traces, box.against, box.x, box.y_lsb, box.channel)
    points = {
        name: {number: np.flatnonzero(mask[at]).tolist() for number, at in picture.samples.items()}
        for name, picture in drawn.items()
        if picture.samples
    }
    return Chosen(int(mask.sum()), points)
