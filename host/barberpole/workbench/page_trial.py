"""A trial: name what was hidden, then see the truth beside the model."""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
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
    """A trial being played. opened: once it was answered; mine: the error of the model then; errors: of the truth."""

    folder: Path
    level: int
    text: str
    opened: game.Opened | None = None
    mine: float | None = None
    errors: list[float] = field(default_factory=list)


def show_answer(page: "Page") -> None:
    """What was added so far is the answer; one press gives it."""
    trial = page.trial
    if trial is None:
        return
    with ui.element("section").classes("bp-card").props("data-test=trial"):
        text_of(f"Level {trial.level}: {trial.text}", "h2", "name").style("margin:0 0 4px;line-height:1.3")
        body = ui.refreshable(_body)

        async def answer(said: tuple[str, ...]) -> None:
            await _answer(page, trial, said)
            body.refresh()

        body(page, trial, answer)


def given(page: "Page") -> tuple[str, ...]:
    """The answer that the model on the bench amounts to."""
    return tuple(name for name in page.session.bench.file.effects if name not in START) or (game.NOTHING,)


async def _answer(page: "Page", trial: Trial, said: tuple[str, ...]) -> None:
    """Open the sealed answer and fit what it names."""
    try:
        trial.opened = game.answer(trial.folder, said)
    except BarberpoleError as error:
        complain(str(error))
        return
    trial.mine = page.session.path.now.heldout_lsb
    trial.errors = await page.session.truth(trial.folder, trial.opened)


def _body(page: "Page", trial: Trial, answer: Callable[[tuple[str, ...]], Awaitable[None]]) -> None:
    if trial.opened is not None:
        _truth(trial, trial.opened)
        return
    text_of("Put in what you think is hidden. Then give your answer: the effects that you added.", "p", "bp-small")
    with ui.row().classes("gap-2").style("margin-top:6px"):
        mine = ui.button("Answer with my model", on_click=lambda: answer(given(page)))
        mine.props("dense unelevated no-caps color=primary")
        other = ui.button("Something unknown", on_click=lambda: answer((game.UNKNOWN,)))
        other.props("dense outline no-caps color=accent")


def _truth(trial: Trial, opened: game.Opened) -> None:
    """The truth beside the model, with what each leaves on held-out stretches."""
    text_of("Right." if opened.right else "Not quite.", "p", "name").props("data-test=outcome")
    left = f"{trial.errors[-1]:.3g} LSB" if trial.errors else "in no catalogue" if opened.hidden else ""
    mine = "" if trial.mine is None else f"{trial.mine:.3g} LSB"
    with ui.element("table").classes("bp-par"):
        for cells in (("", "", "held-out error"), ("hidden", _listed(opened.hidden), left)):
            _row(cells)
        _row(("you", _listed(opened.given), mine))


def _row(cells: tuple[str, ...]) -> None:
    with ui.element("tr"):
        for cell in cells:
            text_of(cell, "td")


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names) or "nothing"
