"""A board watched: what it reads, what it says of itself, a hand rotation guided by what the parameters lack."""

import math
from typing import TYPE_CHECKING

import numpy as np
from nicegui import ui
from serial.tools import list_ports

from barberpole.errors import BarberpoleError
from barberpole.figures import CONFIG, Figure, coverage
from barberpole.figures.figure import plot
from barberpole.figures.theme import BLUE, DARK, GREEN, LIGHT, PURPLE, VERMILLION, look
from barberpole.reasons import TABLE
from barberpole.workbench.guard import below
from barberpole.workbench.look import blank
from barberpole.workbench.rotation import Bound, U, bound
from barberpole.workbench.watch import Seen, Watch
from barberpole.workbench.widgets import complain, press, text_of

if TYPE_CHECKING:
    from barberpole.workbench.page import Page

EVERY_S = 0.5
PATIENCE_S = 20.0  # for a browser that has much to draw
POINTS = 500  # drawn of a trace
HEIGHT = 230


def ports() -> list[str]:
    """Serial ports of this machine."""
    return sorted(port.device for port in list_ports.comports())


def show_ports(page: "Page") -> None:
    """Which board to watch."""

    async def connect() -> None:
        await page.watch(str(field.value or "").strip())

    with ui.row().classes("items-center gap-2 no-wrap").style("width:100%"):
        field = ui.input(
            "Serial port of the board, or of the twin", autocomplete=ports(), value=next(iter(ports()), "")
        )
        field.props("dense outlined").style("flex:1").on("keydown.enter", connect)
        ui.button("Watch", on_click=connect).props("unelevated no-caps color=primary")
    text_of("No board? `barberpole twin pybv11` starts an emulated one and prints its port.", "p", "bp-small")


class Live:
    """The view of one watched board."""

    def __init__(self, page: "Page", watch: Watch):
        self._page, self._watch = page, watch
        with ui.element("section").classes("bp-verdict"):
            with ui.element("div").style("min-width:0"):
                self._state = text_of("Connecting …", "h1", "bp-said").props("data-test=live-state role=status")
                self._about = text_of("", "p", "bp-next").props("data-test=live-about")
            with ui.row().classes("items-center gap-2 no-wrap"):
                self._name = ui.input("Recording", value="recording.bpr").props("dense outlined").style("flex:1")
                self._record = ui.button("Record", icon="fiber_manual_record", on_click=self._toggle)
                self._record.props("unelevated no-caps color=primary")
                ui.button("Restart board", on_click=watch.restart).props("outline no-caps color=accent")
        with ui.element("main").classes("bp-live"):
            with ui.element("section"):
                self._frames = {name: LivePicture(name) for name in ("field", "residual", "offset", "temperature")}
            with ui.element("aside").classes("bp-side"):
                self._guide()
                text_of("What the board says of itself", "h2", "bp-h").style("margin-top:14px")
                self._verdict = text_of("No verdict yet.", "p").props("data-test=live-verdict")
                with ui.element("div").classes("bp-chips"):
                    press("Calibrate itself now", "bp-chip", lambda: watch.say("selfcal now"))
                    press("Ask for its status", "bp-chip", lambda: watch.say("status"))
                self._answer = text_of("", "p", "bp-small").props("data-test=live-answer").style("white-space:pre-line")
                self._events = text_of("", "p", "bp-small").style("white-space:pre-line")
        ui.timer(EVERY_S, self._again)

    def _guide(self) -> None:
        text_of("Guided rotation", "h2", "bp-h")
        self._said = text_of("", "p").props("data-test=rotation role=status").style("min-height:64px;margin:0")
        self._map = ui.plotly(_empty(HEIGHT)).style(f"height:{HEIGHT}px;width:100%")
        self._map_sentence = text_of("", "p", "bp-small").style("min-height:54px")
        press("Begin anew", "bp-chip", self._watch.forget_rotation)

    async def _again(self) -> None:
        """Draw, and wait until the browser has: a slow one must not be sent more than it can show."""
        self.show()
        await ui.run_javascript("true", timeout=PATIENCE_S)

    def show(self) -> None:
        """Draw what is known now."""
        seen = self._watch.seen()
        self._state.text = _state(seen)
        self._about.text = _about(seen)
        self._verdict.text = _verdict(seen.verdict)
        self._answer.text = "\n".join(f"{key}: {value}" for key, value in seen.answer.items() if key != "done")
        self._events.text = "\n".join(seen.events[-6:])
        self._record.text = "Stop recording" if seen.recording else "Record"
        if seen.total:
            for name, picture in _pictures(seen).items():
                self._frames[name].show(picture, self._page.dark)
        found = bound(seen.coverage)
        self._said.text = found.sentence
        figure = _map(seen, found)
        self._map_sentence.text = figure.sentence
        made = figure.plot.update_layout(template=DARK if self._page.dark else LIGHT, height=HEIGHT, dragmode=False)
        self._map.update_figure(made.to_plotly_json() | {"config": CONFIG})

    async def _toggle(self) -> None:
        if self._watch.seen().recording:
            name = self._watch.stop_recording()
            ui.notify(f"{name} is written.", type="positive")
            await self._page.recorded(name)
            return
        try:
            path = below(self._page.session.folder, self._name.value or "", "the recording")
            self._watch.record(path if path.suffix == ".bpr" else path.with_name(path.name + ".bpr"))
        except (BarberpoleError, OSError) as error:
            complain(str(error))


class LivePicture:
    """A trace over the last rows; its title is its last value."""

    def __init__(self, name: str):
        with ui.element("figure").classes("bp-fig").style("margin:0").props(f"data-test=live-{name}"):
            self._title = text_of("", "h3")
            self._plot = ui.plotly(_empty(HEIGHT)).style(f"height:{HEIGHT}px;width:100%")
            self._sentence = text_of("", "p")

    def show(self, figure: Figure, dark: bool) -> None:
        """Replace what is drawn."""
        self._title.text, self._sentence.text = figure.title, figure.sentence
        made = figure.plot.update_layout(template=DARK if dark else LIGHT, height=HEIGHT, uirevision="kept")
        self._plot.update_figure(made.to_plotly_json() | {"config": CONFIG})


def _empty(height: int) -> dict:
    return {"data": [], "layout": blank(height), "config": CONFIG}


def _state(seen: Seen) -> str:
    if seen.state != "live":
        return seen.state[:1].upper() + seen.state[1:]
    return f"Live: {seen.rows['b_ut'][-1]:.3f} µT" if seen.total else "Live: waiting for rows"


def _about(seen: Seen) -> str:
    lost = f"{seen.lost} records lost, {seen.damaged} damaged" if seen.lost or seen.damaged else "no record lost"
    again = f", connected {seen.connections} times" if seen.connections > 1 else ""
    rate = f", {seen.rate_hz:.0f} rows a second" if math.isfinite(seen.rate_hz) else ""
    board = seen.header.get("board", "")
    return f"{board} {seen.total} rows{rate}, {lost}{again}".strip()


def _verdict(verdict: dict) -> str:
    if not verdict:
        return "No verdict yet: it comes with the next power-up."
    gains = ", ".join(f"{1e6 * (g - 1):+.0f}" for g in verdict.get("gain", []))
    reasons = [TABLE[code].text for code in verdict.get("reasons", []) if 0 < code < len(TABLE)]
    said = "accepted" if verdict.get("accepted") else f"refused: {' '.join(reasons).rstrip('.')}"
    return f"Self-calibration {said}. In force: {verdict.get('in_force', '?')}. Gain drift {gains} ppm."


def _pictures(seen: Seen) -> dict[str, Figure]:
    pick = np.unique(np.linspace(0, len(seen.rows["t_s"]) - 1, POINTS).astype(int))
    rows = {name: values[pick] for name, values in seen.rows.items()}
    t, b = rows["t_s"], rows["b_ut"]
    known = float(np.nanmean(seen.rows["b_ut"]))
    left = 1e3 * (seen.rows["b_ut"] - known)
    return {
        "field": _trace("|B|, µT", t, {"|B|": b}, (BLUE,), f"The field is {b[-1]:.3f} µT"),
        "residual": _trace(
            "|B| − mean, nT",
            t,
            {"residual": 1e3 * (b - known)},
            (PURPLE,),
            f"|B| stays within {np.nanstd(left):.3g} nT rms of its mean, {known:.3f} µT",
        ),
        "offset": _trace(
            "SET/RESET offset, LSB",
            t,
            {a: rows[f"offset_{a}"] for a in "xyz"},
            tuple(look(a).colour for a in "xyz"),
            "The bridges' offset, which flipping removes",
        ),
        "temperature": _trace("°C", t, {"temperature": rows["temp_c"]}, (VERMILLION,), f"{rows['temp_c'][-1]:.2f} °C"),
    }


def _trace(y: str, t: np.ndarray, traces: dict[str, np.ndarray], colours: tuple[str, ...], title: str) -> Figure:
    made = plot("board time, s", y, HEIGHT)
    for (name, values), colour in zip(traces.items(), colours, strict=True):
        made.add_scatter(x=t, y=values, mode="lines", name=name, line={"color": colour, "width": 1.2})
    made.update_layout(showlegend=len(traces) > 1)
    spans = "; ".join(f"{name} from {np.nanmin(v):.4g} to {np.nanmax(v):.4g}" for name, v in traces.items())
    return Figure(made, title, f"{y.rsplit(',', 1)[-1].strip()} over the last {t[-1] - t[0]:.0f} s: {spans}.")


def _map(seen: Seen, found: Bound) -> Figure:
    """Where the field pointed, where it points now, and where it should."""
    counts = seen.coverage.counts
    empty = np.zeros((3, 0))
    figure = coverage(empty if seen.coverage.last is None else _directions(counts))
    if seen.coverage.last is not None:
        x, y, z = seen.coverage.last / np.linalg.norm(seen.coverage.last)
        now = {"color": VERMILLION, "size": 12, "line": {"width": 2, "color": "#fff"}}
        figure.plot.add_scatter(
            x=[math.degrees(math.atan2(y, x))], y=[z], mode="markers", marker=now, name="now", showlegend=False
        )
    if not found.enough:
        bands, sectors = counts.shape
        where = [(found.next[1] + 0.5) * 360 / sectors - 180], [(found.next[0] + 0.5) * 2 / bands - 1]
        star = {"color": GREEN, "size": 16, "symbol": "star"}
        figure.plot.add_scatter(x=where[0], y=where[1], mode="markers", marker=star, name="next", showlegend=False)
    figure.plot.update_traces(showscale=False, selector={"type": "heatmap"})
    sentence = (
        f"{int(np.sum(counts > 0))} of {counts.size} directions of equal area were seen, crosses mark the others. "
        "Orange: where the field points now; star: where it should."
    )
    return Figure(figure.plot, figure.title, sentence)


def _directions(counts: np.ndarray) -> np.ndarray:
    """(3, k) a direction for each reading, at most ten a cell: what `coverage` counts again."""
    return np.repeat(U, np.minimum(counts.ravel(), 10), axis=1)
