"""A trial: name what was hidden, then see the truth beside the model."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from nicegui import ui

from barberpole.challenge import game
from barberpole.errors import BarberpoleError
from barberpole.workbench.bench import START
from barberpole.workbench.widgets import complain, text_of

if TYPE_CHECKING:
    from barberpole.workbench.page import Page


@dataclass
class Trial:
    """A trial being played. opened: once it was answered."""

    folder: Path
    level: int
    text: str
    opened: game.Opened | None = None


def show_answer(page: "Page") -> None:
    """What was added so far is the answer; one press gives it."""
    trial = page.trial
    if trial is None:
        return
    with ui.element("section").classes("bp-card").props("data-test=trial"):
        text_of(f"Level {trial.level}: {trial.text}", "h2", "name").style("margin:0 0 4px;line-height:1.3")
        body = ui.refreshable(_body)
        body(page, trial, lambda said: _answer(trial, said, body.refresh))


def given(page: "Page") -> tuple[str, ...]:
    """The answer that the model on the bench amounts to."""
    return tuple(name for name in page.session.bench.file.effects if name not in START) or (game.NOTHING,)


def _answer(trial: Trial, said: tuple[str, ...], again: Callable[[], object]) -> None:
    try:
        trial.opened = game.answer(trial.folder, said)
    except BarberpoleError as error:
        complain(str(error))
        return
    again()


def _body(page: "Page", trial: Trial, answer: Callable[[tuple[str, ...]], None]) -> None:
    if trial.opened is not None:
        _truth(trial.opened)
        return
    text_of("Put in what you think is hidden. Then give your answer: the effects that you added.", "p", "bp-small")
    with ui.row().classes("gap-2").style("margin-top:6px"):
        mine = ui.button("Answer with my model", on_click=lambda: answer(given(page)))
        mine.props("dense unelevated no-caps color=primary")
        ui.button("Something unknown", on_click=lambda: answer((game.UNKNOWN,))).props(
            "dense outline no-caps color=accent"
        )


def _truth(opened: game.Opened) -> None:
    text_of("Right." if opened.right else "Not quite.", "p", "name").props("data-test=outcome")
    with ui.element("table").classes("bp-par"):
        for what, names in (("hidden was", opened.hidden), ("your answer", opened.given)):
            with ui.element("tr"):
                text_of(what, "td")
                text_of(", ".join(names) or "nothing", "td")
