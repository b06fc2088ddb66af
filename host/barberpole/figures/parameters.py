"""What are the parameters worth? How far each is from its null, or from the factory's, in standard errors."""

from collections.abc import Mapping

import numpy as np

from barberpole.calibration import Value
from barberpole.figures.figure import Figure, plot
from barberpole.figures.theme import BLUE, DECADES, GREY, VERMILLION
from barberpole.numbers import signed, uncertain

SURE = 2.0  # standard errors
NAMED = 3  # parameters in the sentence


def parameters(values: Mapping[str, Value], factory: Mapping[str, Value] | None = None) -> Figure:
    """values: "effect.parameter" -> Value. With a factory calibration, the change of those that both have."""
    if factory:
        names = [name for name in values if name in factory]
        return _forest(names, {n: change_sigma(values[n], factory[n]) for n in names}, True, values, factory)
    return _forest(list(values), {n: v.value / max(v.stderr, 1e-300) for n, v in values.items()}, False, values, {})


def change_sigma(now: Value, then: Value) -> float:
    """Change of a parameter in standard errors of the difference."""
    return (now.value - then.value) / max(float(np.hypot(now.stderr, then.stderr)), 1e-300)


def _forest(names: list[str], sigma: dict[str, float], change: bool, values, factory) -> Figure:
    what = "change since the factory" if change else "distance from zero"
    figure = plot(f"{what}, standard errors", "", 110 + 22 * max(len(names), 2))
    size = {name: float(np.clip(abs(sigma[name]), 1e-2, 1e9)) for name in names}
    clear = [abs(sigma[name]) > SURE for name in names]
    text = [_said(name, values, factory) for name in names]
    colours = [(VERMILLION if change else BLUE) if c else GREY for c in clear]
    symbols = [_symbol(sigma[n], c) for n, c in zip(names, clear, strict=True)]
    for name, colour in zip(names, colours, strict=True):
        figure.add_scatter(
            x=[1e-2, size[name]], y=[name, name], mode="lines", line={"color": colour, "width": 2}, hoverinfo="skip"
        )
    figure.add_scatter(
        x=[size[name] for name in names],
        y=names,
        mode="markers",
        marker={"color": colours, "size": 9, "symbol": symbols},
        customdata=text,
        hovertemplate="%{y}: %{customdata}<extra></extra>",
    )
    figure.add_vline(x=SURE, line={"dash": "dash"})
    place = {"x": np.log10(SURE), "xanchor": "center", "y": 1, "yref": "y domain", "yanchor": "bottom"}
    figure.add_annotation(text="2 standard errors", **place)
    figure.update_layout(showlegend=False)
    figure.update_xaxes(type="log", **DECADES)
    figure.update_yaxes(autorange="reversed", categoryorder="array", categoryarray=names, dtick=1)
    return Figure(figure, _title(names, sigma, clear, change), _sentence(names, sigma, text, what))


def _symbol(sigma: float, clear: bool) -> str:
    """The sign, which a logarithmic axis cannot show."""
    return ("triangle-up" if sigma > 0 else "triangle-down") if clear else "circle-open"


def _sentence(names: list[str], sigma: dict[str, float], text: list[str], what: str) -> str:
    order = sorted(range(len(names)), key=lambda at: -abs(sigma[names[at]]))
    first = "; ".join(text[at] for at in order[:NAMED])
    least = f"; least of all {text[order[-1]]}" if len(order) > NAMED else ""
    signs = "Triangles that point down are negative; open circles are within two standard errors."
    return f"By {what}: {first}{least}. {signs}"


def _said(name: str, values: Mapping[str, Value], factory: Mapping[str, Value]) -> str:
    now = values[name]
    unit = f" {now.unit.replace('uT', 'µT')}" if now.unit not in ("", "1") else ""
    said = f"{name} {uncertain(now.value, now.stderr)}{unit}"
    if name in factory:
        return f"{said}, factory {uncertain(factory[name].value, factory[name].stderr)}{unit}"
    return said


def _title(names: list[str], sigma: dict[str, float], clear: list[bool], change: bool) -> str:
    if not names:
        return "No parameter is shared with the factory calibration"
    if change:
        worst = max(names, key=lambda name: abs(sigma[name]))
        if not any(clear):
            return "No parameter has changed by more than two standard errors since the factory"
        moved = f"{sum(clear)} of {len(names)} parameters moved since the factory"
        return f"{moved}, {worst} most ({signed(sigma[worst])} standard errors)"
    return f"{sum(clear)} of {len(names)} parameters differ from zero by more than two standard errors"
