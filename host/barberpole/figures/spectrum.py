"""At which frequencies is what is left? Amplitudes on logarithmic axes."""

from collections.abc import Mapping, Sequence

import numpy as np

from barberpole.diagnose import Comparison
from barberpole.figures.decimate import thin
from barberpole.figures.figure import Figure, plot
from barberpole.figures.theme import DECADES, look
from barberpole.numbers import plain

Values = Sequence[float] | np.ndarray

RISES = 2.0  # of the lowest band over the median: more is no white noise


def spectrum(
    frequency: Values,
    amplitude: Mapping[str, Values],
    unit: str = "LSB",
    f_name: str = "frequency, cycles a sample",
) -> Figure:
    """amplitude: axis -> one value for each frequency, in `unit`."""
    figure = plot(f_name, f"amplitude, {unit}")
    f = np.asarray(frequency)
    for axis, values in amplitude.items():
        how = look(axis)
        line = {"color": how.colour, "dash": how.dash, "width": 1.6}
        figure.add_scatter(x=f, y=thin(np.asarray(values)), mode="lines", line=line, name=axis)
    figure.update_xaxes(type="log", **DECADES)
    figure.update_yaxes(type="log", **DECADES)
    figure.update_layout(showlegend=len(amplitude) > 1)
    title, said = _words(f, amplitude, unit, f_name.partition(",")[2].strip())
    flat = "Flat is white noise; a rise to the left is drift or 1/f noise, a line is an alternating field."
    return Figure(figure, title, f"{said} {flat}")


def residual_spectrum(found: Comparison) -> Figure:
    """The spectrum of a comparison."""
    power = {axis: np.sqrt(p) for axis, p in found.spectrum.items() if axis != "f_per_sample"}
    return spectrum(found.spectrum["f_per_sample"], power)


def _words(f: np.ndarray, amplitude: Mapping[str, Values], unit: str, f_unit: str) -> tuple[str, str]:
    peaks = {axis: int(np.argmax(values)) for axis, values in amplitude.items()}
    over = {axis: float(np.max(v) / max(float(np.median(v)), 1e-300)) for axis, v in amplitude.items()}
    worst = max(amplitude, key=lambda axis: float(np.max(amplitude[axis])))
    at = float(f[peaks[worst]])
    said = f"{worst} peaks at {plain(at, 3)} {f_unit} with {plain(over[worst], 3)} times its median amplitude."
    if over[worst] < RISES:
        return "What is left is white: no frequency stands out", said
    slow = at < float(np.exp(np.mean(np.log(f))))
    return f"What is left is {'slow' if slow else 'fast'}: {worst} stands out at {plain(at, 3)} {f_unit}", said
