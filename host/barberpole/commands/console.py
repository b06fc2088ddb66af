"""What the commands share: JSON on stdout, tables for people, progress on stderr."""

import json
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    SpinnerColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
)
from rich.table import Table
from rich.text import Text

from barberpole.numbers import strict

# No markup: a path or a column's name may hold brackets. Rich wraps no sentence, `say` does: a line is one in a pipe.
OUT = Console(highlight=False, markup=False, soft_wrap=True)
ERR = Console(stderr=True, highlight=False, markup=False)

AS_JSON = typer.Option(False, "--json", help="Print one JSON object and nothing else.")


def print_json(answer: dict[str, Any]) -> None:
    """One line of strict JSON: what is not a finite number becomes null."""
    print(json.dumps(strict(answer)), flush=True)


def folded(sentence: str, console: Console, hang: int = 2) -> str:
    """Broken at words, with `hang` blanks before what follows, where a terminal is too narrow; whole in a pipe."""
    if not console.is_terminal or len(sentence) <= console.width:
        return sentence
    blanks = " " * hang
    return textwrap.fill(
        sentence, console.width, subsequent_indent=blanks, break_long_words=False, break_on_hyphens=False
    )


def say(sentence: str, style: str = "", hang: int = 2, console: Console = OUT) -> None:
    """A sentence for people."""
    console.print(folded(sentence, console, hang), style=style or None, soft_wrap=True)


def table(title: str, *heads: str) -> Table:
    """An empty table in the one look of all tables: numbers to the right, the first column to the left."""
    made = Table(title=title, title_justify="left", header_style="bold", box=None, pad_edge=False)
    for at, head in enumerate(heads):
        made.add_column(head, justify="left" if at == 0 else "right")
    return made


def notes(sentences: tuple[str, ...]) -> None:
    """Remarks about the input, on stderr."""
    for sentence in sentences:
        say(f"note: {sentence}", "dim", console=ERR)


class _Rate(ProgressColumn):
    """What is done a second, of work that is counted in a unit."""

    def render(self, task: Task) -> Text:
        unit = task.fields.get("unit")
        return Text(f"{task.speed or 0.0:,.0f} {unit}/s" if unit else "")


@contextmanager
def progress(what: str, total: int | None = None, unit: str = "") -> Iterator[Callable[[int], None]]:
    """A progress bar on stderr while the work runs; call what it yields with the amount just done, in `unit`."""
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        _Rate(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=ERR, transient=True, disable=not ERR.is_terminal) as bar:
        task = bar.add_task(what, total=total, unit=unit)
        yield lambda done: bar.advance(task, done)
