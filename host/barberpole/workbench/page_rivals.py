"""Two models of the path side by side, on held-out stretches."""

from typing import TYPE_CHECKING

from nicegui import ui

from barberpole.figures import CONFIG
from barberpole.figures.figure import plot
from barberpole.figures.theme import BLUE, DARK, LIGHT, VERMILLION
from barberpole.workbench.look import blank
from barberpole.workbench.rivals import Comparison
from barberpole.workbench.widgets import text_of

if TYPE_CHECKING:
    from barberpole.workbench.page import Page

HEIGHT = 300


class Rivals:
    """The dialog: the model on the bench against another of the path."""

    def __init__(self, page: "Page"):
        self._page, self._session = page, page.session
        with ui.dialog() as self._dialog, ui.card().style("width:720px;max-width:94vw;gap:8px"):
            text_of("Which model is better on data it was not fitted to?", "h2", "bp-title")
            self._other = ui.select({}, label="The model on the bench against", on_change=self._compare)
            self._other.props("dense outlined").style("width:100%")
            self._plot = ui.plotly({"data": [], "layout": blank(HEIGHT), "config": CONFIG})
            self._plot.style(f"height:{HEIGHT}px;width:100%")
            self._said = text_of("", "p").props("role=status data-test=rivals").style("min-height:40px;margin:0")
            ui.button("Close", on_click=self._dialog.close).props("flat no-caps color=accent")

    def open(self) -> None:
        """Show it, with the step before to compare with."""
        history = self._session.path
        others = {at: f"{step.label}: {', '.join(step.bench.file.effects)}" for at, step in enumerate(history.steps)}
        others.pop(history.at)
        self._other.set_options(others, value=None)
        self._said.text = "" if others else "There is one model so far: add or remove an effect first."
        self._dialog.open()
        if others:
            self._other.value = history.now.parent if history.now.parent is not None else next(iter(others))

    async def _compare(self) -> None:
        if self._other.value is None:
            return
        found = await self._session.compare(self._other.value)
        if found is None:
            return
        self._said.text = f"This model against {self._other.options[self._other.value]}. {found.sentence}."
        self._plot.update_figure(self._picture(found))

    def _picture(self, found: Comparison) -> dict:
        made = plot("stretch left out", "error there, LSB rms", HEIGHT)
        names = [f"{at + 1}" for at in range(len(found.one))]
        made.add_bar(x=names, y=found.one, name="this model", marker_color=BLUE)
        made.add_bar(x=names, y=found.other, name="the other", marker_color=VERMILLION)
        made.update_layout(template=DARK if self._page.dark else LIGHT, barmode="group", dragmode=False)
        return made.to_plotly_json() | {"config": CONFIG}
