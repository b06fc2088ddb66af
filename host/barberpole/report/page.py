"""One self-contained HTML file: verdict first, then sections of a sentence, a figure and a table. Opens offline."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import jinja2
import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

from barberpole.files import write_atomic

# Okabe-Ito: distinguishable without colour vision
MEASURED, MODEL, BEFORE, AFTER, NOISE = "#000000", "#0072B2", "#D55E00", "#009E73", "#999999"
AXIS_COLOURS = ("#0072B2", "#E69F00", "#009E73")


@dataclass(frozen=True)
class Table:
    """Rows of text under column heads."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class Section:
    """One question: its title, the answer as a sentence, and what shows it."""

    title: str
    sentence: str
    figures: Sequence[go.Figure] = field(default_factory=tuple)
    tables: Sequence[Table] = field(default_factory=tuple)


def style(figure: go.Figure, title: str, x: str, y: str, height: int = 380) -> go.Figure:
    """The one look of all figures: white, thin grid, units on both axes."""
    figure.update_layout(
        title={"text": title, "font": {"size": 15}},
        template="plotly_white",
        height=height,
        margin={"l": 70, "r": 20, "t": 60, "b": 55},
        legend={"orientation": "h", "y": -0.22},
        font={"family": "system-ui, sans-serif", "size": 13},
    )
    figure.update_xaxes(title_text=x)
    figure.update_yaxes(title_text=y)
    return figure


def write_page(path: Path, title: str, verdict: str, good: bool, sections: Sequence[Section], provenance: str) -> None:
    """Render and write the page, all at once or not at all."""
    template = jinja2.Environment(
        loader=jinja2.PackageLoader("barberpole.report"), autoescape=True, undefined=jinja2.StrictUndefined
    ).get_template("page.html.j2")
    shown = [
        {
            "title": s.title,
            "sentence": s.sentence,
            "tables": s.tables,
            "figures": [
                f.to_html(full_html=False, include_plotlyjs=False, config={"displaylogo": False}) for f in s.figures
            ],
        }
        for s in sections
    ]
    text = template.render(
        title=title, verdict=verdict, good=good, sections=shown, provenance=provenance, plotly=get_plotlyjs()
    )
    write_atomic(path, text)
