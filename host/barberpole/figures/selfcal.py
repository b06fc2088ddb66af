"""Is the board still itself? Gains over power-ups, and what the coil run leaves at each point."""

from collections.abc import Sequence

import numpy as np

from barberpole.figures.decimate import extremes, thin
from barberpole.figures.figure import Figure, level, panel, panels, plot
from barberpole.figures.theme import VERMILLION, look
from barberpole.numbers import plain, signed


def gains(labels: Sequence[str], gain: np.ndarray, limit: float | None = None) -> Figure:
    """gain (k, 3): today's over the factory's at each of k power-ups, oldest first. limit: of |gain - 1|."""
    percent = 100.0 * (np.atleast_2d(gain) - 1.0)
    figure = plot("power-up", "gain against the factory, %")
    for i, axis in enumerate("xyz"):
        how = look(axis)
        figure.add_scatter(
            x=list(labels),
            y=percent[:, i],
            mode="lines+markers",
            name=axis,
            line={"color": how.colour, "dash": how.dash, "width": 1.5},
            marker={"color": how.colour, "symbol": how.symbol, "size": 9},
        )
    level(figure, 0.0)
    for sign in (-1, 1) if limit else ():
        said = f"limit {signed(sign * 100 * (limit or 0))} %"
        figure.add_hline(y=sign * 100 * (limit or 0), line={"color": VERMILLION}, annotation_text=said)
    figure.update_xaxes(type="category")
    last = ", ".join(f"{axis} {p:+.3f} %" for axis, p in zip("xyz", percent[-1], strict=True))
    worst = float(np.max(np.abs(percent[-1])))
    inside = "" if limit is None else ", within the limit" if worst <= 100 * limit else ", beyond the limit"
    title = f"The gains are within {plain(worst, 3)} % of the factory's{inside}"
    return Figure(figure, title, f"{len(percent)} power-ups; at the last, {last} against the factory calibration.")


def points(left: np.ndarray, unit: str = "µT") -> Figure:
    """left (3, m): what the straight line through the coil run leaves at each of its m points."""
    left = np.atleast_2d(left)
    figure = panels(["x", "y", "z"], "point", f"residual, {unit}", 260)
    for col, (axis, r) in enumerate(zip("xyz", left, strict=True), start=1):
        at, how = extremes(r), look(axis)
        dots = {"color": how.colour, "symbol": how.symbol, "size": 5}
        figure.add_scatter(x=at, y=thin(r[at]), mode="markers", marker=dots, name=axis, **panel(col))
        level(figure, 0.0, col)
    rms = np.sqrt(np.mean(left**2, axis=1))
    each = ", ".join(f"{axis} {plain(v, 3)}" for axis, v in zip("xyz", rms, strict=True))
    worst = float(np.max(np.abs(left)))
    sentence = f"Residual of {left.shape[1]} coil points: {each} {unit} rms, at most {plain(worst, 3)} {unit}."
    return Figure(figure, f"The coil run is straight within {worst:.2g} {unit}", sentence)


def error_over_time(t: np.ndarray, error: np.ndarray, unit: str = "nT", what: str = "error") -> Figure:
    """error (3, n) over t (n,) in s: what the board computes less what was applied."""
    figure = panels(["x", "y", "z"], "time, s", f"{what}, {unit}", 260)
    for col, (axis, r) in enumerate(zip("xyz", error, strict=True), start=1):
        at = extremes(r)
        dots = {"color": look(axis).colour, "size": 3}
        figure.add_scatter(x=t[at], y=thin(r[at]), mode="markers", marker=dots, name=axis, **panel(col))
    rms = float(np.sqrt(np.mean(np.square(error))))
    each = ", ".join(f"{a} {plain(np.sqrt(np.mean(r**2)), 3)}" for a, r in zip("xyz", error, strict=True))
    sentence = f"By axis: {each} {unit} rms over {t.size} readings."
    return Figure(figure, f"The {what} is {plain(rms, 3)} {unit} rms", sentence)
