"""The one look of all pictures, on light and on dark ground.

The hues are Okabe and Ito's, which keep apart without colour vision; the four that are used have a contrast of at least
3:1 to both grounds, so a picture is drawn once and only its template changes with the ground. Each axis also has a
symbol and a dash of its own. Black, white and grey come from the template alone.
"""

from dataclasses import dataclass

import plotly.graph_objects as go

BLUE, VERMILLION, GREEN, PURPLE, GREY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#7F8790"
MEASURED, MODELLED, BEFORE, AFTER = GREY, BLUE, VERMILLION, GREEN
NEGATIVE, POSITIVE = "0,114,178", "213,94,0"  # blue and vermillion, as rgb
# nothing is the ground itself, so the same scale serves light and dark
DIVERGING = [[0.0, f"rgba({NEGATIVE},1)"], [0.5, "rgba(127,135,144,0)"], [1.0, f"rgba({POSITIVE},1)"]]
COUNTED = [[0.0, f"rgba({NEGATIVE},0.15)"], [1.0, f"rgba({NEGATIVE},1)"]]
FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif"
HEIGHT = 320  # px of one row of panels
# one label a decade, the lines between unlabelled
DECADES = {"dtick": 1, "minor": {"dtick": "D1", "showgrid": True}, "exponentformat": "power"}
CONFIG = {
    "displaylogo": False,
    "responsive": True,
    "modeBarButtonsToRemove": ["lasso2d", "select2d", "autoScale2d", "zoomIn2d", "zoomOut2d"],
}


@dataclass(frozen=True)
class Ground:
    """Colours of paper, letters and lines; `quiet` letters keep 4.5:1."""

    paper: str
    ink: str
    quiet: str
    grid: str
    raised: str


LIGHT_GROUND = Ground("#ffffff", "#1b1f24", "#57606a", "#e4e7eb", "#f5f6f8")
DARK_GROUND = Ground("#15181c", "#e7eaee", "#a3adb8", "#2d333b", "#1f242a")


@dataclass(frozen=True)
class Look:
    """How one axis is drawn, so that hue is never the only difference."""

    colour: str
    symbol: str
    dash: str


AXES = {
    "x": Look(BLUE, "circle", "solid"),
    "y": Look(VERMILLION, "square", "dash"),
    "z": Look(GREEN, "diamond", "dot"),
    "norm": Look(PURPLE, "circle", "solid"),
}


def look(axis: str) -> Look:
    """The look of x, y, z or norm; any other name is drawn like norm."""
    return AXES.get(axis, AXES["norm"])


def _axis(ground: Ground) -> dict:
    return {
        "gridcolor": ground.grid,
        "zerolinecolor": ground.grid,
        "zerolinewidth": 1,
        "linecolor": ground.quiet,
        "showline": True,
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": ground.quiet,
        "tickfont": {"color": ground.quiet, "size": 12},
        "title": {"font": {"color": ground.ink, "size": 13}, "standoff": 8},
        "automargin": True,
        "minor": {"gridcolor": ground.grid, "griddash": "dot"},
    }


def template(ground: Ground) -> go.layout.Template:
    """What depends on the ground, for plotly; the paper itself shows through."""
    made = go.layout.Template()
    made.layout = {
        "font": {"family": FONT, "size": 13, "color": ground.ink},
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "colorway": [BLUE, VERMILLION, GREEN, PURPLE, GREY],
        "xaxis": _axis(ground),
        "yaxis": _axis(ground),
        "margin": {"l": 64, "r": 20, "t": 34, "b": 50},
        "legend": {"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom", "font": {"color": ground.ink}},
        "hoverlabel": {"bgcolor": ground.raised, "font": {"color": ground.ink, "family": FONT}},
        "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": ground.quiet, "activecolor": ground.ink},
        "shapedefaults": {"line": {"color": ground.ink, "width": 1.2, "dash": "dash"}},
        "annotationdefaults": {"font": {"color": ground.ink, "size": 12}, "showarrow": False},
        "bargap": 0.35,
    }
    bar = {"outlinewidth": 0, "tickcolor": ground.quiet, "tickfont": {"color": ground.quiet}}
    made.data = {"bar": [go.Bar(marker={"line": {"width": 0}})], "heatmap": [go.Heatmap(colorbar=bar)]}
    return made


LIGHT, DARK = template(LIGHT_GROUND), template(DARK_GROUND)
