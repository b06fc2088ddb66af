"""Saving: model, calibration, report, and the firmware built from here."""

from typing import TYPE_CHECKING

from nicegui import ui

from barberpole import paths
from barberpole.workbench.widgets import text_of

if TYPE_CHECKING:
    from barberpole.workbench.page import Page


class Keep:
    """The dialog. Names are within the folder of the workbench."""

    def __init__(self, page: "Page"):
        self._session = page.session
        with ui.dialog() as self._dialog, ui.card().style("width:620px;max-width:94vw;gap:10px"):
            text_of("Keep what was found", "h2", "bp-title")
            text_of(f"Files go to {page.session.folder}.", "p", "bp-small").style("margin:0")
            self._line("Model", "model.toml", self._model)
            self._line("Calibration", "calibration.toml", self._calibration)
            self._line("Report", "report.html", self._report)
            with ui.row().classes("items-center no-wrap w-full gap-2"):
                boards = sorted(path.stem for path in paths.boards().glob("*.toml"))
                self._board = ui.select(boards, value=boards[0], label="Firmware for").props("dense outlined")
                self._board.style("width:200px")
                self._build = ui.input("Folder", value="build").props("dense outlined").style("flex:1")
                ui.button("Build", on_click=self._firmware).props("unelevated no-caps color=primary")
            self._said = (
                text_of("", "p", "bp-small").props("role=status data-test=kept").style("min-height:40px;margin:0")
            )
            ui.button("Close", on_click=self._dialog.close).props("flat no-caps color=accent")

    def open(self) -> None:
        """Show it."""
        self._said.text = ""
        self._dialog.open()

    def _line(self, what: str, name: str, save) -> None:
        with ui.row().classes("items-center no-wrap w-full gap-2"):
            field = ui.input(what, value=name).props("dense outlined").style("flex:1")
            button = ui.button("Save", on_click=lambda: save(field.value)).props("unelevated no-caps color=primary")
            button.props(f'aria-label="Save {what.lower()}"')

    async def _model(self, name: str) -> None:
        self._tell(await self._session.keep("save_model", name))

    async def _calibration(self, name: str) -> None:
        self._tell(await self._session.keep("save_calibration", name, self._session.attempts))

    async def _report(self, name: str) -> None:
        self._tell(await self._session.keep("save_report", name))

    def _tell(self, path: str) -> None:
        self._said.text = f"{path} written." if path else ""

    async def _firmware(self) -> None:
        self._said.text = "Building …"
        budget = await self._session.build(self._board.value, self._build.value or "")
        if budget is None:
            self._said.text = ""
            return
        size = budget["flash_bytes"]["total"]
        self._said.text = (
            f"Built in {self._build.value}: {size} bytes of flash, ROMFS image {budget['romfs_bytes']} bytes. "
            f"Put it on a board with: barberpole flash {self._build.value} --port PORT"
        )
