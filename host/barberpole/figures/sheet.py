"""The data sheet's pictures: residual fields, noise density, frequency response, courses over temperature."""

from collections.abc import Sequence

import numpy as np

from barberpole.characterise.linearity import Linearity
from barberpole.characterise.noise import NoiseFigures
from barberpole.characterise.response import HALF_POWER, Response
from barberpole.characterise.temperature import Course
from barberpole.figures.decimate import scattered, thin
from barberpole.figures.figure import Figure, level, panel, panels, plot
from barberpole.figures.theme import BEFORE, BLUE, DECADES, MODELLED, look
from barberpole.numbers import plain, signed

AT_C = 25.0
STRAIGHT = 0.98  # of the linear residual: a polynomial that leaves more was not needed
SMOOTH = 50  # points of a curve


def residual_fields(line: Linearity) -> Figure | None:
    """What the linear and the polynomial calibration leave, axis by axis (article fig. 5)."""
    if line.field_ut is None or line.residual_ut is None or line.polynomial_ut is None:
        return None
    figure = panels("xyz", "field, µT", "residual, nT")
    kinds = (("linear", line.residual_ut, BEFORE, "circle"), ("polynomial", line.polynomial_ut, MODELLED, "diamond"))
    for i in range(3):
        for name, left, colour, symbol in kinds:
            at = scattered(left[i], 800)
            dots = {"color": colour, "size": 4, "symbol": symbol, "opacity": 0.7}
            figure.add_scatter(
                x=thin(line.field_ut[i, at]),
                y=thin(1000 * left[i, at]),
                mode="markers",
                name=name,
                legendgroup=name,
                showlegend=i == 0,
                marker=dots,
                **panel(i + 1),
            )
    figure.update_layout(showlegend=True, margin={"t": 60}, legend={"y": 1.1})
    linear, bent = (1000 * float(np.sqrt(np.mean(left**2))) for _, left, _, _ in kinds)
    title = f"A polynomial takes the residual from {plain(linear, 3)} to {plain(bent, 3)} nT rms"
    if bent > STRAIGHT * linear:
        title = f"The sensor is straight: a polynomial takes nothing off the {plain(linear, 3)} nT rms"
    said = "Residual of each axis against its own field after the linear (circles) and the polynomial calibration."
    return Figure(figure, title, said)


def density(noise: NoiseFigures, unit: str) -> Figure:
    """Noise density by Welch's method (article fig. 8)."""
    figure = plot("frequency, Hz", f"noise density, {unit}/√Hz")
    for axis, values in zip("xyz", noise.density, strict=True):
        how = look(axis)
        line = {"color": how.colour, "dash": how.dash, "width": 1.5}
        figure.add_scatter(x=noise.frequency_hz, y=thin(values), name=axis, mode="lines", line=line)
    figure.update_xaxes(type="log", **DECADES)
    figure.update_yaxes(type="log", **DECADES)
    corner = noise.corner_hz
    title = f"The noise is 1/f below {plain(corner, 3)} Hz" if corner else "The noise is white over the whole band"
    each = ", ".join(f"{axis} {plain(v, 3)}" for axis, v in zip("xyz", noise.at_1_hz, strict=True))
    return Figure(figure, title, f"One-sided density at rest; at 1 Hz {each} {unit}/√Hz.")


def response(got: Response) -> Figure:
    """Amplitude over that at the lowest frequency (article fig. 6)."""
    figure = plot("frequency, Hz", "relative amplitude, 1")
    figure.add_scatter(
        x=got.frequency_hz,
        y=got.relative,
        error_y={"array": np.nan_to_num(got.stderr)},
        mode="markers+lines",
        line={"color": BLUE},
        showlegend=False,
    )
    level(figure, HALF_POWER)
    figure.add_annotation(text="half power", x=0, xref="x domain", xanchor="left", y=HALF_POWER, yanchor="bottom")
    last = f"at {plain(float(got.frequency_hz[-1]), 3)} Hz is {plain(100 * float(got.relative[-1]), 3)} %"
    said = "From the histograms of a sine (article eq. 8-9); error bars: the scatter of the axes."
    return Figure(figure, f"The amplitude {last} of that at the lowest frequency", said)


def over_temperature(name: str, courses: Sequence[tuple[str, Course]], unit: str) -> Figure:
    """Sensitivity or offset of each axis over temperature, less its value at 25 °C, with the polynomial (fig. 7)."""
    figure = plot("temperature, °C", f"{name} less that at 25 °C, {unit}")
    for axis, one in courses:
        how, at_25 = look(axis), float(one.at(AT_C))
        t = np.linspace(one.temp_c.min(), one.temp_c.max(), SMOOTH)
        dots = {"color": how.colour, "symbol": how.symbol, "size": 7}
        figure.add_scatter(x=one.temp_c, y=one.values - at_25, mode="markers", name=axis, marker=dots)
        line = {"color": how.colour, "dash": how.dash, "width": 1.2}
        figure.add_scatter(x=t, y=one.at(t) - at_25, mode="lines", showlegend=False, line=line)
    drifts = {axis: one.drift(AT_C)[0] for axis, one in courses}
    worst = max(drifts, key=lambda axis: abs(drifts[axis]))
    each = ", ".join(f"{axis} {signed(v)}" for axis, v in drifts.items())
    title = f"The {name} drifts by up to {signed(drifts[worst])} {unit}/K ({worst}, at 25 °C)"
    return Figure(figure, title, f"Slopes at 25 °C: {each} {unit}/K; the lines are the fitted polynomials.")
