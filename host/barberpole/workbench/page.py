"""The page: one window, one session. This module lays it out and tells each part when to look again."""

import inspect
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
    parts: dict[str, list] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.client = ui.context.client
        self.theme = ui.dark_mode(value=None)
        self.session.on_change = self.changed

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

    def show_start(self) -> None:
        """The first screen."""
        self.unwatch()
        self.body.clear()
        self.parts.clear()
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
            for show in self.parts.get(part, ()):
                made = show()
                if inspect.iscoroutine(made):
                    background_tasks.create(made)

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
        with self.body:
            verdict = Verdict(self)
            with ui.element("main").classes("bp-main"):
                self._left()
                with ui.element("section").classes("bp-mid"):
                    pictures = Pictures(self)
                self._right()
        self._listen(verdict, pictures)

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
        again = [lambda p=part: p.refresh() for part in (self.stack, self.history, self.parameters, self.suspects)]
        stack, history, parameters, suspects = again
        self.parts.update(
            history=[stack, history],
            fit=[verdict.show, history, parameters, pictures.draw],
            suspects=[verdict.show, suspects, pictures.judged],
            ground=[pictures.draw],
        )
