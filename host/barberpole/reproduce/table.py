"""All rows as one page of Markdown: a function of the code alone, without date, path or machine."""

from pathlib import Path

from barberpole.files import write_atomic
from barberpole.reproduce import (
    article,
    repeatability,
    thesis_apparatus,
    thesis_calibration,
    thesis_electronics,
    thesis_law,
    thesis_scalar,
)
from barberpole.reproduce.row import Row

INTRODUCTION = """# Published figures, reproduced

Written by `make reproduce`. Each row is a number that a source prints, a printed equation at one point, or a curve that
it shows; and the same computed by the functions of this repository from the inputs that the source gives, or by another
route. A ratio outside 0.98 to 1.02 has a remark that says what in the source does not fit together.
"""


def all_rows(power_ups: int = repeatability.POWER_UPS) -> list[Row]:
    """The rows of all modules, in the order of the sources; power_ups: of the emulated board, for fig. 6.26."""
    return [
        *thesis_law.rows(),
        *thesis_electronics.rows(),
        *thesis_scalar.rows(),
        *thesis_calibration.rows(),
        *repeatability.rows(power_ups),
        *thesis_apparatus.rows(),
        *article.rows(),
    ]


def markdown(rows: list[Row]) -> str:
    """The page: one table for each source, rows as they come."""
    parts = [INTRODUCTION, _summary(rows)]
    for source in dict.fromkeys(row.source for row in rows):
        parts.append(_table(source, [row for row in rows if row.source == source]))
    return "\n".join(parts)


def write_page(path: Path, rows: list[Row] | None = None) -> None:
    """Write the page to `path`; rows: all of them, unless given."""
    write_atomic(path, markdown(all_rows() if rows is None else rows))


def _summary(rows: list[Row]) -> str:
    printed = [row for row in rows if row.published is not None]
    met = sum(row.met for row in printed)
    return (
        f"{len(rows)} rows; of {len(printed)} printed numbers {met} are met within 2 %, {len(printed) - met} are not.\n"
    )


def _table(source: str, rows: list[Row]) -> str:
    lines = [f"## The {source}\n", "| item | quantity | unit | published | ours | ratio | remark |"]
    lines.append("|---|---|---|--:|--:|--:|---|")
    lines += [_line(row) for row in rows]
    return "\n".join(lines) + "\n"


def _line(row: Row) -> str:
    numbers = (_number(row.published), _number(row.ours), "" if row.ratio is None else f"{row.ratio:.3f}")
    cells = (row.item, row.quantity, row.unit, *numbers, row.remark)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _number(value: float | None) -> str:
    """Four digits: what the sources print has no more, and no machine differs there."""
    return "" if value is None else f"{float(value) + 0.0:.4g}"
