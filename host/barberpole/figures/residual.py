"""Where is what the model leaves? By axis, and against anything that was logged or computed."""

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go

from barberpole.diagnose import Comparison, Pattern
from barberpole.diagnose.curves import Curve, binned
from barberpole.figures.decimate import DRAWN, scattered, thin
from barberpole.figures.figure import Figure, listed, noise_band, noise_line, panel, panels, plot
from barberpole.figures.theme import GREY, look
from barberpole.fit.noise import Noise
from barberpole.numbers import plain, signed

CLEAR = 1.1  # times the noise: an axis above it has more than noise


def residual_axes(rms_lsb: Mapping[str, float], noise_lsb: float, unit: str = "LSB") -> Figure:
    """RMS of the residual by axis beside the noise."""
    names = list(rms_lsb)
    figure = plot(f"residual, {unit} rms", "axis", 120 + 36 * len(names))
    figure.add_bar(
        x=list(rms_lsb.values()),
        y=names,
        orientation="h",
        marker_color=[look(name).colour for name in names],
        text=[plain(v) for v in rms_lsb.values()],
        textposition="auto",
    )
    figure.update_yaxes(autorange="reversed")
    figure.update_xaxes(rangemode="tozero")
    noise_line(figure, noise_lsb, unit, across="x")
    above = [name for name in names if rms_lsb[name] > CLEAR * noise_lsb]
    said = (
        f"{listed(above)} {'has' if len(above) == 1 else 'have'} more than noise"
        if above
        else "Every axis is at the noise"
    )
    figures = ", ".join(f"{name} {plain(v)}" for name, v in rms_lsb.items())
    return Figure(figure, said, f"Residual by axis: {figures} {unit} rms; the noise is {plain(noise_lsb)} {unit}.")


def residual_against(
    residual: np.ndarray,
    covariate: np.ndarray,
    name: str,
    axes: Sequence[str] = ("x", "y", "z"),
    noise_lsb: float | None = None,
    pattern: Pattern | None = None,
    rows: np.ndarray | None = None,
    unit: str = "LSB",
    dots: int = DRAWN,
) -> Figure:
    """residual (m, n) against a covariate (n,) whose `name` carries its unit, such as "y field, µT"; or against one
    of each axis (m, n). Some `dots` points of each axis are drawn; the means are of all.

    rows (n,): what each point is called when it is selected (customdata), by default its index. pattern: the
    dependence that was found, which then is the title.
    """
    residual, covariate = np.atleast_2d(residual), np.asarray(covariate, float)
    rows = np.arange(residual.shape[1]) if rows is None else rows
    covariate = np.broadcast_to(covariate, residual.shape)
    curves = []
    figure = panels(axes, name, f"residual, {unit}")
    grey = {"color": GREY, "size": 3, "opacity": 0.45}
    for col, (axis, r, value) in enumerate(zip(axes, residual, covariate, strict=True), start=1):
        at = scattered(r, dots)
        figure.add_scatter(
            x=thin(value[at]), y=thin(r[at]), mode="markers", marker=grey, customdata=rows[at], **panel(col)
        )
        curves.append(Curve(axis, name, *binned(value, r, Noise(np.ones(1))), x_name=name))
    return _with_means(figure, curves, name, noise_lsb, pattern, unit)


def residual_curves(found: Comparison, against: str, pattern: Pattern | None = None, unit: str = "LSB") -> Figure:
    """The curves of a comparison against one covariate: bin means alone, with errors under the noise found."""
    curves = [c for c in found.curves if c.against == against]
    name = curves[0].x_name or against
    figure = panels([c.axis for c in curves], name if len(curves) == 1 else _short(name), f"residual, {unit}")
    return _with_means(figure, curves, name, found.noise_lsb, pattern, unit)


def _short(name: str) -> str:
    """A name that fits under a narrow panel."""
    return name.replace("best combination of ", "best combination of<br>")


def _with_means(figure: go.Figure, curves: Sequence[Curve], name: str, noise, pattern, unit: str) -> Figure:
    for col, curve in enumerate(curves, start=1):
        how = look(curve.axis)
        bars = {"type": "data", "array": [2 * e for e in curve.error_lsb], "thickness": 1.2, "width": 2}
        dots = {"color": how.colour, "symbol": how.symbol, "size": 7}
        figure.add_scatter(
            x=curve.x,
            y=curve.mean_lsb,
            error_y=bars,
            mode="lines+markers",
            line={"color": how.colour, "width": 1},
            marker=dots,
            name=f"{curve.axis}, mean",
            **panel(col),
        )
        if noise is not None and np.isfinite(noise):
            noise_band(figure, noise, col)
    return Figure(figure, _title(curves, name, pattern, unit), _sentence(curves, name, noise, unit))


def _title(curves: Sequence[Curve], name: str, pattern: Pattern | None, unit: str) -> str:
    if pattern:
        return f"{pattern.axis} fails against {pattern.against}: {pattern.shape}"
    worst = max(curves, key=_significance)
    if _significance(worst) < 4.0:
        return f"No mean residual follows {name.split(',')[0]}"
    swing = float(np.ptp(worst.mean_lsb))
    return f"{worst.axis} varies most with {name.split(',')[0]}: its mean moves by {plain(swing, 3)} {unit}"


def _significance(curve: Curve) -> float:
    sized = [abs(m) / e for m, e in zip(curve.mean_lsb, curve.error_lsb, strict=True) if e > 0]
    return max(sized, default=0.0)


def _sentence(curves: Sequence[Curve], name: str, noise: float | None, unit: str) -> str:
    each = "; ".join(f"{c.axis} from {signed(min(c.mean_lsb))} to {signed(max(c.mean_lsb))}" for c in curves)
    band = "" if noise is None or not np.isfinite(noise) else f" The grey band is the noise, ±{plain(noise, 3)} {unit}."
    return f"Mean residual in {unit} in bins of {name}, with two standard errors: {each}.{band}"
