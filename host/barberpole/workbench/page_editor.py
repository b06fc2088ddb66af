"""A user's own physics: `forward` in an editor, what is wrong with it beside the line, and then it is a suspect."""

from typing import TYPE_CHECKING

from nicegui import ui

from barberpole.workbench.own import line_of, template
from barberpole.workbench.widgets import text_of

if TYPE_CHECKING:
    from barberpole.workbench.page import Page


class Editor:
    """A dialog that keeps its text while the window is open."""

    def __init__(self, page: "Page"):
        self._page = page
        with ui.dialog() as self._dialog, ui.card().style("width:880px;max-width:94vw;gap:8px"):
            text_of("Write an effect of your own", "h2", "bp-title")
            about = (
                "Fill in forward; with all parameters at their null it must leave the field as it is. Derivatives, "
                "fit and diagnosis follow. The file goes to the folder of this workbench and runs on this machine."
            )
            text_of(about, "p", "bp-small").style("margin:0")
            self._name = ui.input("Name: small letters, digits and _", value="my_effect").props("dense outlined")
            self._name.style("width:300px")
            self._code = ui.codemirror(template(), language="Python", line_wrapping=True).style("height:380px")
            self._code.props('aria-label="Code of the effect"').style("border:1px solid var(--grid);border-radius:6px")
            self._wrong = text_of("", "p", "bp-error").props("role=alert data-test=effect-error")
            with ui.row().classes("gap-2"):
                ui.button("Try it", on_click=self._try).props("unelevated no-caps color=primary")
                ui.button("Close", on_click=self._dialog.close).props("flat no-caps color=accent")

    def open(self) -> None:
        """Show it."""
        self._code.set_theme("githubDark" if self._page.dark else "githubLight")
        self._dialog.open()

    async def _try(self) -> None:
        self._wrong.text = "Trying …"
        self._code.decorations = []
        tried, wrong = await self._page.session.write_effect((self._name.value or "").strip(), self._code.value or "")
        self._wrong.text = wrong
        if tried is None:
            line = line_of(wrong)
            if line is not None:
                self._code.decorations = [{"kind": "line", "line": line, "class": "bp-wrong"}]
            return
        self._dialog.close()
        ui.notify(f"{tried.name} has joined the suspects. {'; '.join(tried.notes)}.", type="positive", multi_line=True)
