"""The page: one window, one session. This module lays it out and tells each part when to look again."""

import asyncio
import inspect
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from nicegui import background_tasks, ui

from barberpole.challenge import game
from barberpole.errors import BarberpoleError
from barberpole.figures.theme import BLUE
from barberpole.modelfile import read_model
from barberpole.workbench import look
from barberpole.workbench.page_editor import Editor
from barberpole.workbench.page_keep import Keep
from barberpole.workbench.page_live import Live, show_ports
from barberpole.workbench.page_pictures import Pictures
from barberpole.workbench.page_rivals import Rivals
from barberpole.workbench.page_side import show_history, show_parameters, show_stack
from barberpole.workbench.page_start import show_start
from barberpole.workbench.page_suspects import show_suspects
from barberpole.workbench.page_trial import Trial, show_answer
from barberpole.workbench.page_verdict import Verdict
from barberpole.workbench.session import Session
from barberpole.workbench.watch import Watch
from barberpole.workbench.widgets import complain, press, text_of

SENT_S = 0.02  # what was changed goes to the browser within this time


def build(folder: Path, log: Path | None = None) -> None:
    """Register the page. `log` is open in every new window; `/?seed=3` repeats the trials of that seed."""

    @ui.page("/")
    async def window(seed: int | None = None) -> None:
        ui.add_head_html(f"<style>{look.CSS}{look.RULES}</style>")
        page = Page(Session(folder), seed=seed)
        page.client.on_delete(page.close)
        page.lay_out()
        await page.client.connected(timeout=20.0)
        page.dark = bool(await ui.run_javascript("matchMedia('(prefers-color-scheme: dark)').matches"))
        page.colours()
        if log is not None:
            await page.open(log)


@dataclass
class Page:
    """What the parts of the page share."""

    session: Session
    dark: bool = False
    seed: int | None = None
    trial: Trial | None = None
    watched: Watch | None = None
    pictures: Pictures | None = None
    parts: dict[str, dict[int, Callable]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.client = ui.context.client
        self.theme = ui.dark_mode(value=None)
        self.session.on_change = self.changed
        self._due: dict[int, Callable] = {}
        self._painting = False

    def colours(self) -> None:
        """The palette of the pictures for buttons and switches."""
        ui.colors(primary=BLUE, accent=look.ACCENT[self.dark], negative="#b34700", positive="#00704f")

    def lay_out(self) -> None:
        """Everything that is always there."""
        self.colours()
        self.editor, self.keep, self.rivals = Editor(self), Keep(self), Rivals(self)
        self._header()
        self.body = ui.element("div").style("width:100%")
        self._busy()
        ui.keyboard(self._key, ignore=["input", "select", "textarea"])
        ui.on("bp_seen", lambda e: self.pictures and self.pictures.seen(e.args["name"], e.args["in_view"]))
        self.show_start()

    def _header(self) -> None:
        with ui.element("header").classes("bp-head").style("width:100%"):
            ui.html('<span class="bp-word">barber<b>pole</b></span>', sanitize=False)
            self.log_name = text_of("", "div", "bp-log")
            self.tools = ui.row().classes("items-center gap-1 no-wrap")
            with self.tools:
                self._tool("Open", "folder_open", self.show_start, "Open another log or trial")
                self.bench_tools = ui.row().classes("items-center gap-1 no-wrap")
            with self.tools, self.bench_tools:
                self._tool("Save", "save", self.keep.open, "Model, calibration, report, firmware")
                self._tool("Undo", "undo", lambda: self.session.walk(lambda h: h.undo()), "Undo (z)")
                self._tool("Redo", "redo", lambda: self.session.walk(lambda h: h.redo()), "Redo (y)")
            self.tools.set_visibility(False)
            ui.button(icon="contrast", on_click=self.turn).props(
                'flat round dense color=accent aria-label="Light or dark"'
            )

    def _tool(self, text: str, icon: str, handler, hint: str) -> None:
        ui.button(text, icon=icon, on_click=handler).props("flat dense no-caps size=13px color=accent").tooltip(hint)

    def _busy(self) -> None:
        self.busy = ui.element("div").classes("bp-busy").props("role=status aria-live=polite")
        with self.busy:
            ui.spinner(size="18px")
            self.busy_text = ui.label()
            press("Cancel", "bp-chip", self.session.cancel)
        self.busy.set_visibility(False)

    async def turn(self) -> None:
        """Light to dark and back."""
        self.dark = not self.dark
        self.theme.value = self.dark
        self.colours()
        self.changed("ground")

    async def _key(self, event) -> None:
        if event.action.keydown and not event.modifiers.ctrl and not event.modifiers.meta and self.session.history:
            if event.key == "z":
                await self.session.walk(lambda h: h.undo())
            elif event.key == "y":
                await self.session.walk(lambda h: h.redo())

    async def look_at(self, against: str) -> None:
        """Draw the residual against something that a pattern names."""
        summary = self.session.summary
        if self.pictures is not None and summary is not None and against in summary.abscissae:
            await self.pictures.look_at(against)

    def show_start(self) -> None:
        """The first screen."""
        self.unwatch()
        self.body.clear()
        self.parts.clear()
        self._due.clear()
        self.tools.set_visibility(False)
        self.log_name.text = ""
        uploads = Path(self.session.own.name)
        with self.body:
            show_start(self.session.folder, uploads, self.open, self.play, lambda: show_ports(self))

    async def open(self, path: Path) -> None:
        """Put a log on the bench."""
        with self.client:
            self.trial = None
            await self.session.open(path)

    async def play(self, level: int) -> None:
        """Make a trial and put it on the bench."""
        with self.client:
            folder = Path(self.session.own.name) / f"trial-{len(list(Path(self.session.own.name).iterdir()))}"
            try:
                chosen = game.new(folder, level, self.seed)
            except BarberpoleError as error:
                complain(str(error))
                return
            self.trial = Trial(folder, level, chosen.text)
            rest = folder / game.REST
            await self.session.open(folder / game.LOG, read_model(folder / game.MODEL), rest if rest.exists() else None)

    async def watch(self, port: str) -> None:
        """Watch the board at a port."""
        self.unwatch()
        watch = Watch(port)
        try:
            watch.start()
        except BarberpoleError as error:
            complain(str(error))
            return
        self.watched = watch
        self.log_name.text = f"Live: {port}"
        self.tools.set_visibility(True)
        self.bench_tools.set_visibility(False)
        self.body.clear()
        self.parts.clear()
        self._due.clear()
        with self.body:
            Live(self, watch)

    def unwatch(self) -> None:
        """The board goes on without being watched."""
        watched, self.watched = self.watched, None
        if watched:
            watched.close()

    async def recorded(self, name: str) -> None:
        """A recording is whole: put it on the bench."""
        self.unwatch()
        await self.open(self.session.folder / name)

    def close(self) -> None:
        """The window is gone."""
        self.unwatch()
        self.session.close()

    def changed(self, part: str) -> None:
        """A part of the session has changed: show it."""
        with self.client:
            if part == "log":
                self._show_bench()
            elif part == "message":
                complain(self.session.message)
            elif part == "busy":
                self.busy.set_visibility(bool(self.session.busy))
                self.busy_text.text = f"{self.session.busy} …"
            self._due |= self.parts.get(part, {})
            if self._due and not self._painting:
                self._painting = True
                background_tasks.create(self._paint())

    async def _paint(self) -> None:
        """Show what has changed, what is looked at first, each once, and each sent off before the next is made."""
        try:
            while self._due:
                with self.client:
                    made = self._due.pop(min(self._due))()
                    if inspect.iscoroutine(made):
                        await made
                await asyncio.sleep(SENT_S)
        finally:
            self._painting = False

    def _show_bench(self) -> None:
        opened = self.session.opened
        if opened is None:
            return
        known = {"vector": "field known", "magnitude": "magnitude known", "constant": "magnitude constant"}
        what = f"Trial, level {self.trial.level}" if self.trial else opened.name
        self.log_name.text = f"{what}  ·  {opened.rows:,} rows  ·  {known[opened.reference]}".replace(",", "\u2009")
        self.tools.set_visibility(True)
        self.bench_tools.set_visibility(True)
        self.body.clear()
        self.parts.clear()
        self._due.clear()
        with self.body:
            verdict = Verdict(self)
            with ui.element("main").classes("bp-main"):
                self._left()
                with ui.element("section").classes("bp-mid"):
                    self.pictures = Pictures(self)
                self._right()
        self._listen(verdict, self.pictures)

    def _left(self) -> None:
        with ui.element("nav").classes("bp-side"):
            self.stack = ui.refreshable(lambda: show_stack(self))
            self.stack()
            self.history = ui.refreshable(lambda: show_history(self))
            self.history()
            press("Compare two models", "bp-chip", self.rivals.open).style("margin:8px 0")
            self.parameters = ui.refreshable(lambda: show_parameters(self))
            self.parameters()

    def _right(self) -> None:
        with ui.element("aside").classes("bp-side"):
            if self.trial:
                show_answer(self)
            self.suspects = ui.refreshable(lambda: show_suspects(self))
            self.suspects()
            press("Write an effect of your own", "bp-chip", self.editor.open).style("margin-top:14px")

    def _listen(self, verdict: Verdict, pictures: Pictures) -> None:
        first: dict[int, Callable] = {0: verdict.show, 1: pictures.draw, 2: pictures.judged}
        later: dict[int, Callable] = {3: self.history.refresh, 4: self.suspects.refresh, 5: pictures.rest}
        last: dict[int, Callable] = {6: self.stack.refresh, 7: self.parameters.refresh}
        shows = {
            "history": (3, 6),
            "fit": (0, 1, 3, 5, 7),
            "suspects": (0, 2, 4),
            "ground": (1, 5),
        }
        every = first | later | last
        self.parts.update({part: {turn: every[turn] for turn in turns} for part, turns in shows.items()})
