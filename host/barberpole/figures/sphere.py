"""In which directions? Residual and coverage on an equal-area map of the sphere of field directions."""

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go

from barberpole.figures.figure import Figure, panel, panels, plot
from barberpole.figures.theme import COUNTED, DIVERGING, GREY
from barberpole.numbers import signed

LATITUDES = (-90, -30, 0, 30, 90)  # labels; the axis is their sine, so that equal areas look equal
BANDS, SECTORS = 12, 24
SMALL = {"size": 12}
BAR = {"thickness": 12, "outlinewidth": 0, "tickfont": SMALL}
Map = Sequence[Sequence[float | None]]


def sphere(maps: Mapping[str, Map], unit: str = "LSB") -> Figure:
    """maps: axis -> mean residual by latitude band (equal area) and longitude sector, None where nothing was."""
    figure = panels(list(maps), "longitude, °", "latitude, °")
    limit = max((abs(v) for rows in maps.values() for row in rows for v in row if v is not None), default=1.0) or 1.0
    for col, rows in enumerate(maps.values(), start=1):
        values = _numbers(rows)
        last = col == len(maps)
        colours = {"colorscale": DIVERGING, "zmin": -limit, "zmax": limit, "showscale": last}
        bar = BAR | {"title": {"text": unit, "font": SMALL}}
        figure.add_trace(_heat(values, unit, colorbar=bar if last else None, **colours, **panel(col)))
        figure.add_trace(_never(np.isnan(values), **panel(col)))
    _degrees(figure)
    return Figure(figure, *_words(maps, unit))


def coverage(field: np.ndarray) -> Figure:
    """field (3, n), any unit: how many readings were taken in each direction."""
    counts = direction_counts(field)
    figure = plot("longitude, °", "latitude, °")
    bar = BAR | {"title": {"text": "readings", "font": SMALL}}
    shown = np.where(counts > 0, counts, np.nan).astype(float)
    figure.add_trace(_heat(shown, "readings", colorscale=COUNTED, colorbar=bar))
    figure.add_trace(_never(counts == 0))
    _degrees(figure)
    share = 100.0 * float(np.mean(counts > 0))
    sentence = (
        f"Of {counts.size} directions of equal area, {int(np.sum(counts > 0))} were seen, with at most "
        f"{int(counts.max())} readings in one; crosses mark those that were never seen."
    )
    return Figure(figure, f"The field pointed into {share:.0f} % of all directions", sentence)


def direction_counts(field: np.ndarray, bands: int = BANDS, sectors: int = SECTORS) -> np.ndarray:
    """(bands, sectors): readings by direction of the field (3, n), cells of equal area."""
    x, y, z = np.asarray(field) / np.maximum(np.linalg.norm(field, axis=0), 1e-300)
    row = np.minimum(((z + 1) / 2 * bands).astype(int), bands - 1)
    column = np.minimum(((np.arctan2(y, x) / np.pi + 1) / 2 * sectors).astype(int), sectors - 1)
    return np.bincount(row * sectors + column, minlength=bands * sectors).reshape(bands, sectors)


def _numbers(rows: Map) -> np.ndarray:
    return np.array([[np.nan if v is None else v for v in row] for row in rows], float)


def _centres(shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Longitudes in degrees and sines of latitude of the cells."""
    bands, sectors = shape
    return (np.arange(sectors) + 0.5) * 360 / sectors - 180, (np.arange(bands) + 0.5) * 2 / bands - 1


def _heat(values: np.ndarray, unit: str, **how) -> go.Heatmap:
    x, y = _centres(values.shape)
    latitude = np.broadcast_to(np.degrees(np.arcsin(y))[:, None], values.shape)
    hover = f"longitude %{{x:.0f}}°, latitude %{{customdata:.0f}}°: %{{z:.3g}} {unit}<extra></extra>"
    return go.Heatmap(z=values, x=x, y=y, customdata=latitude, hovertemplate=hover, **how)


def _never(absent: np.ndarray, **place: str) -> go.Scatter:
    """A small cross in each cell that was never seen."""
    x, y = _centres(absent.shape)
    row, column = np.nonzero(absent)
    cross = {"symbol": "x-thin", "size": 4, "line": {"color": GREY, "width": 1}}
    return go.Scatter(x=x[column], y=y[row], mode="markers", marker=cross, hoverinfo="skip", showlegend=False, **place)


def _degrees(figure: go.Figure) -> None:
    figure.update_xaxes(tickvals=[-120, 0, 120], tickangle=0, range=[-180, 180], showgrid=False, zeroline=False)
    sines = [float(np.sin(np.radians(v))) for v in LATITUDES]
    figure.update_yaxes(
        tickvals=sines, ticktext=[str(v) for v in LATITUDES], range=[-1, 1], showgrid=False, zeroline=False
    )


def _words(maps: Mapping[str, Map], unit: str) -> tuple[str, str]:
    arrays = {axis: _numbers(rows) for axis, rows in maps.items()}
    worst = max(arrays, key=lambda axis: float(np.nanmax(np.abs(arrays[axis]), initial=0.0)))
    values = arrays[worst]
    seen = int(np.sum(~np.isnan(values)))
    if not seen:
        return "No direction was seen", "The map is empty."
    row, column = np.unravel_index(int(np.nanargmax(np.abs(values))), values.shape)
    x, y = _centres(values.shape)
    where = f"longitude {x[column]:.0f}°, latitude {np.degrees(np.arcsin(y[row])):.0f}°"
    title = f"The largest mean residual by direction is {signed(values[row, column])} {unit} ({worst}, at {where})"
    sentence = (
        f"Mean residual by direction of the field in the sensor's frame, equal areas; {seen} of {values.size} "
        "directions were seen, crosses mark the others. A smooth pattern of two or more colours is no noise."
    )
    return title, sentence
