"""A user's own effect, written in the page: tried where it can do no harm, kept in the folder once it works."""

import re
from dataclasses import dataclass, replace
from pathlib import Path

from barberpole.effects import Effect
from barberpole.files import read_text, write_atomic
from barberpole.plugins import TEMPLATE, load_plugin
from barberpole.workbench.bench import Bench
from barberpole.workbench.lab import Lab

LINE = re.compile(r"line (\d+)")


@dataclass(frozen=True)
class Tried:
    """What the trial of an effect says. notes: what using it costs."""

    name: str
    equation: str
    notes: tuple[str, ...]


def template(name: str = "my_effect") -> str:
    """The text to begin with."""
    return read_text(TEMPLATE, "the template").replace("NAME", name)


def try_effect(lab: Lab, path: Path, text: str) -> Tried:
    """Write the file and hold the effect against its contract. Raises InputError: what is wrong, in which line.

    A file that fails leaves what was there before.
    """
    before = path.read_bytes() if path.exists() else None
    write_atomic(path, text)
    try:
        effect = load_plugin(path)
    except BaseException:
        path.unlink() if before is None else write_atomic(path, before)
        raise
    return _said(effect)


def _said(effect: Effect) -> Tried:
    return Tried(effect.name, effect.equation, effect.notes)


def with_plugin(bench: Bench, path: Path) -> Bench:
    """The bench with one more file of own effects; they are suspects from then on."""
    plugins = tuple(dict.fromkeys((*bench.file.plugins, str(path))))
    return bench.with_file(replace(bench.file, plugins=plugins))


def line_of(sentence: str) -> int | None:
    """The line that an error names."""
    found = LINE.search(sentence)
    return int(found[1]) if found else None
