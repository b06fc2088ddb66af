"""Does the error fall with each effect that is added, and how far is it from the noise?"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from barberpole.calibration import Step
from barberpole.diagnose import Diagnosis
from barberpole.figures.figure import Figure, noise_line, plot
from barberpole.figures.theme import AFTER, BEFORE, BLUE, DECADES
from barberpole.numbers import plain

LOGARITHMIC = 8.0  # times the noise: a larger fall needs a logarithmic axis
FLOOR = 1.1  # times the noise: an error below it is at the floor
WIDE = 72  # letters that fit under all stages together


@dataclass(frozen=True)
class Stage:
    """A model on the path: what was done to reach it, and the errors in LSB it leaves."""

    name: str
    heldout_lsb: float
    rms_lsb: float


def stages_of_history(history: Sequence[Step], first: str = "first model") -> list[Stage]:
    """The path of a calibration."""
    names = [f"+ {s.added}" if s.added else f"− {s.removed}" if s.removed else first for s in history]
    return [
        Stage(n, s.rms_lsb if s.heldout_rms_lsb is None else s.heldout_rms_lsb, s.rms_lsb)
        for n, s in zip(names, history, strict=True)
    ]


def stages_of_diagnosis(found: Diagnosis) -> list[Stage]:
    """The model given, then with each suspect put in."""
    names = ["model", *(f"+ {s.effect}" for s in found.suspects)]
    return [Stage(n, f.heldout_rms_lsb, f.rms_lsb) for n, f in zip(names, found.fits, strict=False)]


def waterfall(stages: Sequence[Stage], noise_lsb: float) -> Figure:
    """Held-out error after each stage, the falls between them, and the noise floor."""
    left = np.array([s.heldout_lsb for s in stages])
    steep = np.isfinite(noise_lsb) and left.max() > LOGARITHMIC * max(noise_lsb, 1e-300)
    figure = plot("", "held-out error, LSB rms", 340)
    place, change = list(range(len(stages))), left[1:] - left[:-1]
    figure.add_bar(
        x=place[1:],
        y=np.abs(change),
        base=np.minimum(left[1:], left[:-1]),
        width=0.3,
        marker={"color": [AFTER if c < 0 else BEFORE for c in change], "opacity": 0.55},
        hoverinfo="skip",
        showlegend=False,
    )
    dots = {"color": BLUE, "size": 10, "symbol": "diamond"}
    names = [s.name for s in stages]
    said = "%{text}: %{y:.4g} LSB<extra></extra>"
    how = {"mode": "markers", "text": names, "hovertemplate": said, "marker": dots}
    figure.add_scatter(x=place, y=left, cliponaxis=False, showlegend=False, **how)
    room = WIDE // len(stages)
    labels = [_label(s, before, room) for s, before in zip(stages, [None, *left[:-1]], strict=True)]
    figure.update_xaxes(tickvals=place, ticktext=labels, tickangle=0, range=[-0.5, len(place) - 0.5], showgrid=False)
    if steep:
        figure.update_yaxes(DECADES | {"type": "log", "dtick": "D2"})
    else:
        figure.update_yaxes(rangemode="tozero")
    if np.isfinite(noise_lsb):
        noise_line(figure, noise_lsb, logarithmic=bool(steep))
    return Figure(figure, *_words(stages, noise_lsb))


def _label(stage: Stage, before: float | None, room: int) -> str:
    """Name, error and change under a stage; a name of more letters than there is room for is broken where it can be."""
    change = "" if before is None else f" ({100 * (stage.heldout_lsb / before - 1.0):+.0f} %)"
    return f"{_broken(stage.name, room)}<br><b>{plain(stage.heldout_lsb)}</b>{change}"


def _broken(name: str, room: int) -> str:
    """In two lines, at the comma or the underscore nearest to the middle, where one would be too long."""
    breaks = [at + 1 for at, letter in enumerate(name) if letter in ",_"]
    if len(name) <= room or not breaks:
        return name
    at = min(breaks, key=lambda place: abs(place - len(name) / 2))
    return f"{name[:at]}<br>{name[at:].strip()}"


def _words(stages: Sequence[Stage], noise: float) -> tuple[str, str]:
    first, last = stages[0].heldout_lsb, stages[-1].heldout_lsb
    path = ", ".join(f"{s.name} {plain(s.heldout_lsb)}" for s in stages)
    sentence = f"Error on stretches never fitted, LSB rms: {path}; noise floor {plain(noise)}."
    reached = ", the noise floor" if last < FLOOR * noise else ""
    if len(stages) == 1:
        return (f"The error is {'at' if reached else f'{plain(last / noise, 3)} times'} the noise floor", sentence)
    verb = "falls" if last < first else "rises"
    return f"The error {verb} from {plain(first)} to {plain(last)} LSB{reached}", sentence
