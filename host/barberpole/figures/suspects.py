"""Which effect is missing? Suspects by what they take off the error on stretches never fitted."""

from barberpole.diagnose import Diagnosis
from barberpole.figures.figure import Figure, listed, plot
from barberpole.figures.theme import AFTER
from barberpole.numbers import plain

SAID = {
    "adequate": "No effect is missing: nothing significant is left",
    "unexplained": "Something is left that no effect of the catalogue explains",
    "inconclusive": "This log cannot say which effect is missing",
}


def suspects(found: Diagnosis) -> Figure:
    """Fall of the held-out error by suspect, most telling first, with what each cannot be told from."""
    named = found.suspects
    figure = plot("fall of the held-out error, %", "suspect", 110 + 42 * max(len(named), 1))
    rivals = [", ".join(s.confounded_with) or "nothing" for s in named]
    figure.add_bar(
        x=[100 * s.heldout_drop for s in named],
        y=[s.effect for s in named],
        orientation="h",
        marker_color=AFTER,
        text=[f"{100 * s.heldout_drop:.1f} %, leaves {plain(s.rms_after_lsb)} LSB" for s in named],
        textposition="auto",
        customdata=rivals,
        hovertemplate="%{y}: %{x:.1f} %; cannot be told from %{customdata}<extra></extra>",
    )
    figure.update_yaxes(autorange="reversed")
    figure.update_xaxes(range=[0, 100])
    each = "; ".join(
        f"{s.effect} takes {100 * s.heldout_drop:.1f} % off and leaves {plain(s.rms_after_lsb)} LSB"
        + (f" (cannot be told from {listed(s.confounded_with)})" if s.confounded_with else "")
        for s in named
    )
    sentence = (
        f"{each}. The noise is {plain(found.noise_lsb)} LSB." if named else found.next_experiment or SAID["adequate"]
    )
    return Figure(figure, _title(found), sentence)


def _title(found: Diagnosis) -> str:
    if found.verdict != "missing" or not found.suspects:
        return SAID.get(found.verdict, found.verdict)
    names = [s.effect for s in found.suspects]
    return f"{listed(names)} {'is' if len(names) == 1 else 'are'} missing"
