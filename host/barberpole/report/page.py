"""One self-contained HTML file: verdict first, then sections of a sentence, pictures and tables.

It opens offline (plotly is in it, once), on light and on dark ground, prints, and keeps its place while it draws. A
page may carry the object that --json prints; its numbers then point into it.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from barberpole.figures.figure import Figure
from barberpole.figures.theme import CONFIG, DARK, DARK_GROUND, LIGHT, LIGHT_GROUND
from barberpole.files import write_atomic
from barberpole.numbers import strict

MARKS = {"good": "✓", "bad": "✗", "open": "?"}
Text = str | Markup  # a str is escaped, a Markup stands as it is


@dataclass(frozen=True)
class Table:
    """Rows of text under column heads."""

    head: Sequence[str]
    rows: Sequence[Sequence[Text]]


@dataclass(frozen=True)
class Section:
    """One question: its title, the answer as a sentence, and what shows it. level 1 opens a chapter."""

    title: str
    sentence: Text
    figures: Sequence[Figure] = field(default_factory=tuple)
    tables: Sequence[Table] = field(default_factory=tuple)
    level: int = 2
    mark: str = ""


def write_page(
    path: Path,
    title: str,
    verdict: Text,
    mark: str,
    sections: Sequence[Section],
    provenance: str,
    answer: dict[str, Any] | None = None,
) -> None:
    """Render and write the page, all at once or not at all. mark: good, bad or open."""
    template = jinja2.Environment(
        loader=jinja2.PackageLoader("barberpole.report"), autoescape=True, undefined=jinja2.StrictUndefined
    ).get_template("page.html.j2")
    pictures, shown = [], []
    for section in sections:
        frames = [{"at": len(pictures) + i, "figure": figure} for i, figure in enumerate(section.figures)]
        pictures += [_picture(figure) for figure in section.figures]
        shown.append({"section": section, "frames": frames, "mark": MARKS.get(section.mark, "")})
    text = template.render(
        title=title,
        verdict=verdict,
        mark=mark,
        sign=MARKS[mark],
        shown=shown,
        provenance=provenance,
        plotly=Markup(get_plotlyjs()),
        light=LIGHT_GROUND,
        dark=DARK_GROUND,
        pictures=script(pictures),
        templates=script({"light": LIGHT.to_plotly_json(), "dark": DARK.to_plotly_json()}),
        config=script(CONFIG),
        answer=script(strict(answer)) if answer is not None else None,
    )
    write_atomic(path, text)


def _picture(figure: Figure) -> dict[str, Any]:
    """Data and layout as the script draws them; the template comes from the page."""
    drawn = json.loads(figure.plot.to_json() or "{}")
    drawn["layout"].pop("template", None)
    return drawn


def script(value: Any) -> Markup:
    """JSON that cannot end the element that it stands in."""
    text = json.dumps(value, ensure_ascii=False, default=_plotly)
    return Markup(text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029"))


def _plotly(value: Any) -> Any:
    return value.to_plotly_json()
