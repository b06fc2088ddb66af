"""The few building blocks of the page."""

from collections.abc import Callable
from typing import Any

from nicegui import ui


def press(text: str, classes: str, handler: Callable[..., Any], **attributes: object) -> ui.element:
    """A button in plain HTML: reached by the tab key, pressed by space or return."""
    button = ui.element("button").classes(classes).props("type=button").on("click", lambda _: handler())
    for name, value in attributes.items():
        button.props(f'{name.replace("_", "-")}="{value}"')
    with button:
        text_of(text)
    return button


def text_of(text: str, tag: str = "span", classes: str = "") -> ui.label:
    """Text in an element of its own; never read as HTML."""
    made = ui.label(text).classes(classes)
    made.tag = tag
    return made


def sentence(text: str) -> str:
    """With a capital letter, as a sentence of its own."""
    return text[:1].upper() + text[1:]


def complain(sentence: str) -> None:
    """One clear message, until it is read."""
    ui.notify(sentence, type="negative", multi_line=True, close_button="OK", timeout=0, position="top")
