"""The first thing seen: what is the matter, in one sentence, and the error as a bar with the noise floor in it."""

import math
from typing import TYPE_CHECKING

from nicegui import ui

from barberpole.workbench.suspects import Suspicion
from barberpole.workbench.widgets import sentence, text_of

if TYPE_CHECKING:
    from barberpole.workbench.page import Page

AT_FLOOR = 1.1  # times the noise: an error below it is at the floor


class Verdict:
    """The strip below the header."""

    def __init__(self, page: "Page"):
        self._session = page.session
        self._scale = 0.0
        with ui.element("section").classes("bp-verdict").props("aria-live=polite aria-label=Verdict"):
            with ui.element("div").style("min-width:0"):
                self._said = text_of("Fitting …", "h1", "bp-said").props("data-test=verdict")
                self._next = text_of("", "p", "bp-next")
            with ui.element("div"):
                with ui.element("div").classes("bp-figure").style("margin:0 0 4px"):
                    text_of("Error on stretches not fitted")
                    self._error = text_of("").props("data-test=heldout").style("font-weight:620")
                self._bar = ui.element("div").classes("bp-fall").props("role=img")
                with self._bar:
                    self._fill, self._floor = ui.element("i").style("width:0"), ui.element("u").style("left:0")
                with ui.element("div").classes("bp-figure"):
                    self._ratio, self._noise = text_of("", classes="bp-small"), text_of("", classes="bp-small")
                    self._noise.props("data-test=noise")

    def show(self) -> None:
        """Sentence and bar of what is on the bench."""
        session = self._session
        said, following = sentences(session.suspicion, session.thinking)
        self._said.text, self._next.text = said, following
        if session.summary is None:
            return
        error, noise = session.summary.heldout_lsb, session.noise_lsb
        self._error.text = f"{error:.4g} LSB"
        first = session.path.steps[0].heldout_lsb or error
        self._scale = max(first, error, 1e-300)
        self._fill.style(f"width:{100 * min(error / self._scale, 1.0):.1f}%")
        self._show_floor(error, noise)

    def _show_floor(self, error: float, noise: float | None) -> None:
        if noise is None or not math.isfinite(noise):
            self._noise.text, self._ratio.text = "", ""
            self._floor.set_visibility(False)
            return
        reached = error < AT_FLOOR * noise
        self._floor.set_visibility(True)
        self._floor.style(f"left:{100 * min(noise / self._scale, 1.0):.1f}%")
        self._noise.text = f"noise floor {noise:.4g} LSB"
        self._ratio.text = "at the noise floor" if reached else f"{error / noise:.3g} times the noise"
        self._bar.classes(add="floor" if reached else "", remove="" if reached else "floor")
        self._bar.props(f'aria-label="Error {error:.4g} LSB, noise floor {noise:.4g} LSB"')


def sentences(found: Suspicion | None, thinking: bool) -> tuple[str, str]:
    """The verdict in one sentence, and what to do next."""
    if found is None:
        return ("Looking for what is missing …" if thinking else "Not judged yet"), ""
    named = [s.effect for s in found.suspects if s.named]
    following = sentence(found.next_experiment)
    if found.verdict == "missing":
        verb = "is" if len(named) == 1 else "are"
        rivals = [r for s in found.suspects if s.named for r in s.confounded_with]
        doubt = f", or {', '.join(rivals)}: this log cannot tell" if rivals else ""
        return f"{' and '.join(named)} {verb} missing from the model{doubt}", following
    if found.verdict == "adequate":
        return "The model is adequate: what is left is noise", "What this log cannot see is on the right."
    if found.verdict == "unexplained":
        return "Something is left that no known effect explains", following or "See what it follows, below."
    return "This log cannot carry a verdict", following
