"""What every picture is: a plot, the title that it answers, and a sentence for who cannot see it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import plotly.graph_objects as go

from barberpole.figures.theme import DARK, GREY, HEIGHT, LIGHT
from barberpole.numbers import plain

GAP = 0.025  # between panels, of the width


@dataclass(frozen=True)
class Figure:
    """A picture: the title is the answer, or the question, and stands outside the plot; so does the sentence."""

    plot: go.Figure
    title: str
    sentence: str

    @property
    def height(self) -> int:
        """px; fixed, so that a page can keep its place."""
        return int(getattr(self.plot.layout, "height", None) or HEIGHT)

    def on(self, dark: bool) -> "Figure":
        """The same picture on the other ground."""
        return replace(self, plot=go.Figure(self.plot).update_layout(template=DARK if dark else LIGHT))


def plot(x: str, y: str, height: int = HEIGHT) -> go.Figure:
    """One empty panel with named axes, units in the names."""
    made = go.Figure()
    made.update_layout(template=LIGHT, height=height)
    return made.update_xaxes(title_text=x).update_yaxes(title_text=y)


def panels(names: Sequence[str], x: str, y: str, height: int = HEIGHT) -> go.Figure:
    """Panels side by side that share the vertical axis, each under its name; `panel` says in which a trace is drawn.

    Laid out in one go: plotly checks a figure again at each change of it, which takes longer than to compute it.
    """
    width = (1.0 - GAP * (len(names) - 1)) / len(names)
    axes, titles = {}, []
    for at, name in enumerate(names):
        left, number = at * (width + GAP), "" if at == 0 else str(at + 1)
        axes[f"xaxis{number}"] = {"anchor": f"y{number}", "domain": [left, left + width], "title": {"text": x}}
        shared = {"matches": "y", "showticklabels": False} if at else {"title": {"text": y}}
        axes[f"yaxis{number}"] = {"anchor": f"x{number}", "domain": [0.0, 1.0]} | shared
        # to the left, clear of the buttons
        place = {"x": left, "xref": "paper", "xanchor": "left", "y": 1.0, "yref": "paper", "yanchor": "bottom"}
        titles.append({"text": name, "showarrow": False, "font": {"size": 13, "weight": 600}} | place)
    return go.Figure(layout={"template": LIGHT, "height": height, "showlegend": False, "annotations": titles} | axes)


def panel(number: int) -> dict[str, str]:
    """What draws a trace in a panel of `panels`, from 1 on."""
    return {"xaxis": f"x{number}", "yaxis": f"y{number}"} if number > 1 else {"xaxis": "x", "yaxis": "y"}


def level(figure: go.Figure, y: float, panel: int = 1) -> None:
    """A thin line across one panel."""
    number = "" if panel == 1 else str(panel)
    line = {"dash": "solid", "width": 0.8}
    figure.add_shape(type="line", x0=0, x1=1, xref=f"x{number} domain", y0=y, y1=y, yref=f"y{number}", line=line)


def noise_band(figure: go.Figure, noise: float, panel: int = 1) -> None:
    """A grey band of ± the noise across one panel."""
    number = "" if panel == 1 else str(panel)
    place = {"x0": 0, "x1": 1, "xref": f"x{number} domain", "y0": -noise, "y1": noise, "yref": f"y{number}"}
    figure.add_shape(type="rect", fillcolor=GREY, opacity=0.16, line={"width": 0}, layer="below", **place)


def noise_line(
    figure: go.Figure, noise: float, unit: str = "LSB", across: str = "y", logarithmic: bool = False
) -> None:
    """The noise floor, dashed, with its figure; `across` names the axis that carries the error."""
    if across == "y":
        figure.add_hline(y=noise, line={"dash": "dash"})
        # an annotation on a logarithmic axis stands at the logarithm of its place, a line does not
        at = float(np.log10(noise)) if logarithmic else noise
        place = {"x": 0, "xref": "x domain", "xanchor": "left", "xshift": 4, "y": at, "yanchor": "bottom"}
    else:
        figure.add_vline(x=noise, line={"dash": "dash"})
        place = {"x": noise, "xanchor": "left", "xshift": -4, "y": 1, "yref": "y domain", "yanchor": "bottom"}
    figure.add_annotation(text=f"noise {plain(noise)} {unit}", **place)


def listed(names: Sequence[str]) -> str:
    """x, y and z in a sentence."""
    names = list(names)
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}" if names else "nothing"
