"""Does the model follow the measurement? Readings and prediction over time, and what is left."""

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from barberpole.figures.decimate import DRAWN, extremes, thin
from barberpole.figures.figure import Figure
from barberpole.figures.theme import LIGHT, MEASURED, look
from barberpole.numbers import plain

ROW = 130  # px of one axis
CONSTANT = 1e-6  # of its size, within which a modelled magnitude does not vary


def traces(
    t: np.ndarray,
    measured: np.ndarray,
    modelled: np.ndarray,
    axes: Sequence[str] = ("x", "y", "z"),
    unit: str = "LSB",
    t_name: str = "time, s",
    dots: int = DRAWN,
) -> Figure:
    """t (n,), measured and modelled (m, n): one row an axis, peaks kept, and a last row with the residual of all.

    Some `dots` points of what was measured are drawn of each axis.
    """
    t, measured, modelled = np.asarray(t), np.atleast_2d(measured), np.atleast_2d(modelled)
    rows = len(axes) + 1
    figure = make_subplots(rows=rows, cols=1, shared_xaxes=True, vertical_spacing=0.04)
    for row, axis in enumerate(axes):
        _pair(figure, row + 1, axis, t, measured[row], modelled[row], dots)
        figure.update_yaxes(title_text=f"{axis}, {unit}", row=row + 1, col=1)
        left = measured[row] - modelled[row]
        at = extremes(left)
        line = {"color": look(axis).colour, "width": 1}
        figure.add_scatter(x=t[at], y=thin(left[at]), mode="lines", line=line, name=f"residual {axis}", row=rows, col=1)
    figure.update_yaxes(title_text=f"residual, {unit}", row=rows, col=1)
    figure.update_xaxes(title_text=t_name, row=rows, col=1)
    figure.update_layout(template=LIGHT, height=ROW * rows + 90)
    rms = np.sqrt(np.mean((measured - modelled) ** 2))
    title, size = _left(rms, measured, modelled, unit)
    sentence = (
        f"{t.size} readings of {', '.join(axes)} against {t_name.split(',')[0]}, measured in grey under the model in "
        f"colour; {size}, and {plain(rms)} {unit} rms are left (last row)."
    )
    return Figure(figure, title, sentence)


def _left(rms: float, measured: np.ndarray, modelled: np.ndarray, unit: str) -> tuple[str, str]:
    """What is left as a share of what a model can follow; a magnitude that should not vary, as one of itself."""
    if len(modelled) == 1 and np.ptp(modelled) < CONSTANT * np.mean(np.abs(modelled)):
        whole = float(np.mean(np.abs(modelled)))
        return f"The model leaves {plain(100.0 * rms / max(whole, 1e-300), 3)} % of the field", (
            f"the field is {plain(whole)} {unit}"
        )
    size = float(np.sqrt(np.mean((measured - measured.mean(axis=1, keepdims=True)) ** 2)))
    share = plain(100.0 * rms / max(size, 1e-300), 3)
    return f"The model leaves {share} % of what the readings vary by", f"they vary by {plain(size)} {unit} rms"


def _pair(figure: go.Figure, row: int, axis: str, t: np.ndarray, measured, modelled, most: int) -> None:
    at = extremes(measured, most)
    shared = {"row": row, "col": 1, "showlegend": row == 1}
    dots = {"color": MEASURED, "size": 4}
    figure.add_scatter(
        x=t[at], y=thin(measured[at]), mode="markers", marker=dots, name="measured", legendgroup="m", **shared
    )
    at = extremes(modelled)
    line = {"color": look(axis).colour, "width": 1.2}
    figure.add_scatter(
        x=t[at], y=thin(modelled[at]), mode="lines", line=line, name="modelled", legendgroup="f", **shared
    )
