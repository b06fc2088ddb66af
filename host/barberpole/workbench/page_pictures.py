"""The pictures in the middle, the choice of what to draw against, and brushing: a box in one shows in all."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from nicegui import events, ui

from barberpole.figures import CONFIG, Stage, waterfall
from barberpole.workbench.look import blank
from barberpole.workbench.pictures import HEIGHTS, Box, Picture, View
from barberpole.workbench.widgets import press, text_of

if TYPE_CHECKING:
    from barberpole.workbench.page import Page

PATH_HEIGHT = 300
WATCH = """
const look = new IntersectionObserver(seen => seen.forEach(one => emitEvent(
    'bp_seen', {name: one.target.dataset.test.slice(7), in_view: one.isIntersecting})), {rootMargin: '150px'});
const find = () => {
    const all = document.querySelectorAll('.bp-main figure');
    all.length ? all.forEach(one => look.observe(one)) : setTimeout(find, 30);
};
setTimeout(find, 30);  // once the page has them
"""


class Frame:
    """One picture with its title above and its sentence below; as high empty as full."""

    def __init__(self, name: str, height: int, before: Any = None):
        with ui.element("figure").classes("bp-fig").style("margin:0").props(f"data-test=figure-{name}"):
            self._title = text_of("", "h3")
            if before:
                before()
            empty = {"data": [], "layout": blank(height), "config": CONFIG}
            self.plot = ui.plotly(empty).style(f"height:{height}px;width:100%")
            self._sentence = text_of("", "p")

    def show(self, picture: Picture) -> None:
        """Replace what is drawn."""
        self._title.text, self._sentence.text = picture.title, picture.sentence
        self.plot.update_figure(picture.plot)


class Pictures:
    """The middle of the page."""

    def __init__(self, page: "Page"):
        self._page, self._session = page, page.session
        self.against = "t_s"
        self._box: Box | None = None
        self._path_drawn: tuple | None = None
        self._noise_drawn: float | None = None
        self._asked = False
        self._stale: set[str] = set()
        self._in_view: set[str] = set()
        self._brush_bar()
        self._frames = {
            "residual": Frame("residual", HEIGHTS["residual"], self._chips),
            "traces": Frame("traces", HEIGHTS["traces"]),
        }
        self._path = Frame("path", PATH_HEIGHT)
        self._frames["sphere"] = Frame("sphere", HEIGHTS["sphere"])
        for name in ("residual", "traces"):
            plot = self._frames[name].plot
            plot.on("plotly_selected", lambda e, n=name: self._selected(n, e), args=["range"])
            plot.on("plotly_deselect", self._clear)
        ui.run_javascript(WATCH)

    def _brush_bar(self) -> None:
        with ui.element("div").classes("bp-brush").style("padding:0 16px"):
            self._hint = text_of("Draw a box in a picture to choose rows.", classes="bp-small")
            self._tools = ui.row().classes("gap-1 items-center")
            with self._tools:
                press("Leave them out", "bp-chip", self._exclude)
                press("Forget the choice", "bp-chip", self._clear)
            self._tools.set_visibility(False)
            self._back = press("Take all rows in again", "bp-chip", self._session.include_all)
            self._back.set_visibility(False)

    def _chips(self) -> None:
        self._row = ui.element("div").classes("bp-chips").props("role=group aria-label='Residual against'")
        self._buttons: dict[str, ui.element] = {}
        self._marks: dict[str, tuple[bool, bool]] = {}

    def _fill_chips(self) -> None:
        known = self._session.summary.abscissae if self._session.summary else {}
        if set(known) != set(self._buttons):
            self._row.clear()
            with self._row:
                self._buttons = {
                    name: press(_chip(title), "bp-chip", lambda n=name: self.look_at(n), title=title)
                    for name, title in known.items()
                }
            self._marks = {}
        follows = {against for _, against, _, _ in self._patterns()}
        for name, button in self._buttons.items():
            marks = (name == self.against, name in follows)
            if self._marks.get(name) != marks:
                self._marks[name] = marks
                button.props(f"aria-pressed={'true' if marks[0] else 'false'}")
                button.classes(add="follows" if marks[1] else "", remove="" if marks[1] else "follows")

    def _patterns(self) -> tuple[tuple[str, str, str, float], ...]:
        return self._session.suspicion.patterns if self._session.suspicion else ()

    async def look_at(self, against: str) -> None:
        """Draw the residual against something else."""
        self.against, self._asked = against, True
        await self._draw("residual")
        self._fill_chips()

    async def draw(self) -> None:
        """What is looked at first, of what is on the bench; `rest` draws the others."""
        self._forget()
        summary = self._session.summary
        if summary is None:
            return
        if self.against not in summary.abscissae:
            self.against = "t_s"
        await self._draw("residual")

    async def rest(self) -> None:
        """The other pictures: now where they are in view, else when they come into it."""
        if self._session.summary is None:
            return
        self._fill_chips()
        self._back.set_visibility(bool(self._session.bench.excluded))
        self._stale = {"traces", "path", "sphere"}
        for name in ("traces", "path", "sphere"):
            await self._freshen(name)

    async def seen(self, name: str, in_view: bool) -> None:
        """A picture has come into view, or left it."""
        self._in_view = self._in_view | {name} if in_view else self._in_view - {name}
        await self._freshen(name)

    async def _freshen(self, name: str) -> None:
        if name in self._stale and name in self._in_view and self._session.summary is not None:
            self._stale.discard(name)
            if name == "path":
                self.draw_path()
            else:
                await self._draw(name)

    async def _draw(self, name: str) -> None:
        if name == "residual":
            self._noise_drawn = self._session.noise_lsb
        picture = await self._session.picture(self._view(), name)
        if picture is not None:
            self._frames[name].show(picture)

    def _view(self) -> View:
        return View(self.against, self._noise_drawn, self._page.dark)

    async def judged(self) -> None:
        """The noise may be known by now, and where the model fails worst: that is drawn unless something else was asked
        for."""
        summary, unknown = self._session.summary, self._noise_drawn is None and self._session.noise_lsb is not None
        worst = next((p[1] for p in self._patterns() if summary and p[1] in summary.abscissae), self.against)
        turn = not self._asked and worst != self.against
        if self._session.suspicion is not None:
            self._asked = True  # what is looked at stays while effects come and go
        if turn:
            self.against = worst
        if turn or unknown:
            await self._draw("residual")
        self._fill_chips()
        self._stale.add("path")
        await self._freshen("path")

    def draw_path(self) -> None:
        """The error along the path."""
        history = self._session.path
        steps = [history.steps[at] for at in history.trail()]
        stages = [Stage(s.label, s.heldout_lsb, s.rms_lsb or s.heldout_lsb) for s in steps if s.heldout_lsb is not None]
        if not stages:
            return
        noise = self._session.noise_lsb
        if self._path_drawn == (stages, noise, self._page.dark):
            return
        self._path_drawn = (stages, noise, self._page.dark)
        figure = waterfall(stages, float("nan") if noise is None else noise)
        if noise is None:
            figure = replace(figure, title=f"The error is {stages[-1].heldout_lsb:.4g} LSB; the noise is not known yet")
        plot = figure.on(self._page.dark).plot.update_layout(height=PATH_HEIGHT, autosize=True, dragmode=False)
        self._path.show(Picture(plot.to_plotly_json() | {"config": CONFIG}, figure.title, figure.sentence))

    async def _selected(self, name: str, event: events.GenericEventArguments) -> None:
        box = box_of(name, event.args.get("range") or {}, self.against)
        if box is None:
            return
        found = await self._session.select(box, self._view())
        if found is None:
            return
        self._box = box
        self._hint.text = f"{found.samples:,} samples chosen".replace(",", "\u2009")
        self._tools.set_visibility(True)
        for other, traces in found.points.items():
            numbers = list(traces)
            self._frames[other].plot.run_plot_method(
                "restyle", {"selectedpoints": [traces[n] for n in numbers]}, numbers
            )

    async def _exclude(self) -> None:
        if self._box is not None:
            await self._session.exclude(self._box)

    def _clear(self, _: object = None) -> None:
        self._forget()
        for name in ("residual", "traces"):
            plot = self._frames[name].plot
            plot.run_plot_method("restyle", {"selectedpoints": None})
            plot.run_plot_method("relayout", {"selections": []})

    def _forget(self) -> None:
        self._box = None
        self._hint.text = "Draw a box in a picture to choose rows."
        self._tools.set_visibility(False)


def _chip(title: str) -> str:
    """The axis title without its unit."""
    return title.split(",")[0].removeprefix("the ")


def box_of(name: str, found: dict, against: str) -> Box | None:
    """The box that plotly reports: {"x2": [..], "y": [..]} names the panel it was drawn in."""
    across = next((key for key in found if key.startswith("x")), None)
    if across is None:
        return None
    low, high = (float(v) for v in found[across])
    if name == "traces":
        return Box("t_s", (low, high))
    up = next((key for key in found if key.startswith("y")), None)
    y = tuple(float(v) for v in found[up]) if up else None
    return Box(against, (low, high), (y[0], y[1]) if y else None, int(across[1:] or 1) - 1)
