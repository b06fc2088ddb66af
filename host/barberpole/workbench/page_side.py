"""The left side: the effect stack as switches, the path of attempts, the parameters."""

import math
from typing import TYPE_CHECKING

from nicegui import ui

from barberpole.workbench.widgets import press, text_of

if TYPE_CHECKING:
    from barberpole.workbench.page import Page


def show_stack(page: "Page") -> None:
    """Every effect in physical order, from the field to the reading, with a switch."""
    session = page.session
    opened = session.opened
    if opened is None or session.history is None:
        return
    text_of("Model: from the field to the reading", "h2", "bp-h")
    inside = session.bench.file.effects
    with ui.element("div").classes("bp-stack").props("role=group aria-label=Effects"):
        for name, why in opened.effects.items():
            on = name in inside
            with ui.element("div").classes("bp-row"):
                text_of(name, classes=f"bp-eff {'' if on else 'bp-off'}")
                switch = ui.switch(value=on, on_change=lambda _, n=name: session.toggle(n)).props(
                    f'dense aria-label="{name}"'
                )
                if why and not on:
                    switch.disable()
                    switch.tooltip(why)


def show_history(page: "Page") -> None:
    """The path: each attempt with the error it left; pressing one goes there."""
    history = page.session.history
    if history is None:
        return
    text_of("Path", "h2", "bp-h").style("margin-top:16px")
    path = set(history.path())
    with ui.element("div").props("role=list aria-label=Path"):
        for depth, at in history.tree():
            step = history.steps[at]
            error = "" if step.heldout_lsb is None else f"{step.heldout_lsb:.3g}"
            button = press(step.label, f"bp-step {'' if at in path else 'off'}", lambda n=at: _go(page, n))
            button.style(f"padding-left:{6 + 12 * depth}px").props('aria-current="step"' if at == history.at else "")
            with button:
                text_of(error)


async def _go(page: "Page", at: int) -> None:
    await page.session.walk(lambda history: history.go(at))


def show_parameters(page: "Page") -> None:
    """What was fitted, with standard errors."""
    summary = page.session.summary
    if summary is None:
        return
    with ui.expansion("Parameters", value=False).props("dense").classes("bp-h").style("margin-top:14px;width:100%"):
        with ui.element("table").classes("bp-par"):
            for name, value, error, unit in summary.parameters:
                with ui.element("tr"):
                    text_of(name, "td")
                    text_of(with_error(value, error), "td")
                    text_of(unit, "td")
        if summary.unobservable:
            text_of(f"Not determined by this log: {', '.join(summary.unobservable)}", "p", "bp-small")


def with_error(value: float, error: float) -> str:
    """A number to the digits its standard error allows: 10.234 ± 0.012."""
    if not (math.isfinite(error) and error > 0):
        return f"{value:.5g}"
    digits = 1 - math.floor(math.log10(error))
    if -3 <= digits <= 6:
        return f"{value:.{max(digits, 0)}f} ± {error:.{max(digits, 0)}f}"
    return f"{value:.3e} ± {error:.0e}"
