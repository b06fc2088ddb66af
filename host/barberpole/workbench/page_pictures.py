"""The pictures in the middle, the choice of what to draw against, and brushing: a box in one shows in all."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from nicegui import events, ui

from barberpole.figures import CONFIG, Stage, waterfall
from barberpole.workbench.pictures import HEIGHTS, Box, Picture, View
from barberpole.workbench.widgets import press, text_of

if TYPE_CHECKING:
    from barberpole.workbench.page import Page

WANTED = ("traces", "residual", "sphere")
PATH_HEIGHT = 300


class Frame:
    """One picture with its title above and its sentence below; as high empty as full."""

    def __init__(self, name: str, height: int, before: Any = None):
        with ui.element("figure").classes("bp-fig").style("margin:0").props(f"data-test=figure-{name}"):
            self._title = text_of("", "h3")
            if before:
                before()
            empty = {"data": [], "layout": {"height": height, "autosize": True}, "config": CONFIG}
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

    def _fill_chips(self) -> None:
        known = self._session.abscissae
        if set(known) != set(self._buttons):
            self._row.clear()
            with self._row:
                self._buttons = {
                    name: press(_chip(title), "bp-chip", lambda n=name: self.look_at(n), title=title)
                    for name, title in known.items()
                }
        for name, button in self._buttons.items():
            button.props(f"aria-pressed={'true' if name == self.against else 'false'}")

    async def look_at(self, against: str) -> None:
        """Draw the residual against something else."""
        self.against = against
        self._fill_chips()
        await self._draw(("residual",))

    async def draw(self) -> None:
        """All pictures of what is on the bench."""
        self._forget()
        if self._session.summary is None:
            return
        if self.against not in self._session.abscissae:
            self.against = "t_s"
        self._fill_chips()
        self._back.set_visibility(bool(self._session.bench.excluded))
        await self._draw(("residual",))  # what is looked at first
        self.draw_path()
        for name in ("traces", "sphere"):
            await self._draw((name,))

    async def _draw(self, wanted: tuple[str, ...]) -> None:
        view = View(self.against, self._session.noise_lsb, self._page.dark)
        if "residual" in wanted:
            self._noise_drawn = view.noise_lsb
        for name, picture in (await self._session.pictures(view, wanted)).items():
            self._frames[name].show(picture)

    async def judged(self) -> None:
        """The noise may be known by now."""
        self.draw_path()
        if self._noise_drawn is None and self._session.noise_lsb is not None:
            await self._draw(("residual",))

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
        found = await self._session.select(box)
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
