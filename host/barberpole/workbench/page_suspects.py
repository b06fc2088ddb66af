"""The right side: what the model lacks, ranked, each ready to be put in."""

from typing import TYPE_CHECKING

from nicegui import ui

from barberpole.workbench.suspects import Suspect, Suspicion
from barberpole.workbench.widgets import press, sentence, text_of

if TYPE_CHECKING:
    from barberpole.workbench.page import Page

MOST = 8


def show_suspects(page: "Page") -> None:
    """Cards, the named first; once nothing is missing, what this log cannot tell and what to measure next."""
    found = page.session.suspicion
    thinking = "yes" if page.session.thinking else "no"
    with ui.element("section").classes("bp-suspects").props(f"data-thinking={thinking}"):
        _listed(page, found)


def _listed(page: "Page", found: Suspicion | None) -> None:
    text_of("Suspects", "h2", "bp-h")
    if found is None:
        text_of("Looking …" if page.session.thinking else "None yet.", "p", "bp-small")
        return
    if not found.suspects:
        text_of("No absent effect would explain anything that is left.", "p", "bp-small")
    for suspect in found.suspects[:MOST]:
        _card(page, suspect)
    if found.patterns and found.verdict != "adequate":
        text_of("What the residual follows", "h2", "bp-h").style("margin-top:14px")
        for axis, against, shape, rms in found.patterns[:5]:
            said = f"{axis}: {shape}, {rms:.3g} LSB rms"
            press(said, "bp-pattern", lambda name=against: page.look_at(name), title="draw it")
    _blind(found)


def _blind(found: Suspicion) -> None:
    """What this log could not show even if it were there, by reason, and the experiment that would."""
    reasons: dict[str, list[str]] = {}
    for name, why in found.cannot_be_judged.items():
        reasons.setdefault(why, []).append(name)
    if found.cannot_be_seen:
        reasons["looks like what the model has already"] = list(found.cannot_be_seen)
    if reasons:
        text_of("What this log cannot see", "h2", "bp-h").style("margin-top:16px")
    for why, names in sorted(reasons.items()):
        with ui.element("div").classes("bp-blind"):
            text_of(why, "div")
            with ui.element("div").classes("bp-names"):
                for name in sorted(names):
                    text_of(name, "span", "bp-name")
    if found.next_experiment and found.verdict == "adequate":
        text_of("Measure next", "h2", "bp-h").style("margin-top:16px")
        text_of(sentence(found.next_experiment), "p", "bp-next-step")


def _card(page: "Page", suspect: Suspect) -> None:
    with ui.element("article").classes(f"bp-card {'named' if suspect.named else ''}"):
        with ui.row().classes("items-center no-wrap w-full gap-2"):
            text_of(suspect.effect, "h3", "name").style("flex:1;margin:0;line-height:1.3")
            button = ui.button("Add", on_click=lambda: page.session.add(suspect)).props(
                f'dense unelevated no-caps color=primary aria-label="Add {suspect.effect}"'
            )
            button.style("padding:2px 14px")
            if not suspect.named:
                button.props("outline color=accent")
        text_of(suspect.equation, "div", "bp-eq")
        text_of(suspect.summary, "div", "bp-small")
        with ui.element("div").classes("bp-meter").props(f'role=img aria-label="explains {suspect.explains:.0%}"'):
            ui.element("i").style(f"width:{100 * suspect.explains:.0f}%")
        text_of(_effect_of(suspect), "div", "bp-small")
        if suspect.confounded_with:
            text_of(f"Looks like {', '.join(suspect.confounded_with)} in this log", "div", "bp-small")


def _effect_of(suspect: Suspect) -> str:
    share = f"explains {suspect.explains:.0%} of what is left above the noise"
    if suspect.heldout_drop is None:
        return share
    return f"{share}; held-out error {-suspect.heldout_drop:+.0%}"
