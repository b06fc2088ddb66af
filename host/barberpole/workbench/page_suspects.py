"""The right side: what the model lacks, ranked, each ready to be put in."""

from typing import TYPE_CHECKING

from nicegui import ui

from barberpole.workbench.suspects import Suspect
from barberpole.workbench.widgets import text_of

if TYPE_CHECKING:
    from barberpole.workbench.page import Page

MOST = 8


def show_suspects(page: "Page") -> None:
    """Cards, the named first."""
    found = page.session.suspicion
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
            text_of(f"{axis}: {shape} in {against}, {rms:.3g} LSB rms", "p", "bp-small")
    if found.cannot_be_seen:
        text_of(f"This log cannot show {', '.join(found.cannot_be_seen)}.", "p", "bp-small").style("margin-top:10px")
    for why in sorted(set(found.cannot_be_judged.values())):
        names = [name for name, reason in found.cannot_be_judged.items() if reason == why]
        text_of(f"Not judged ({why}): {', '.join(names)}.", "p", "bp-small")


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
