"""`python -m barberpole.docs FOLDER`: the reference pages that are written by the code itself."""

import dataclasses
import sys
from pathlib import Path

from barberpole.arrays.array_file import Array
from barberpole.board_tables import Board, Member
from barberpole.bring_up import bring_up
from barberpole.driver_board import Driver
from barberpole.files import write_atomic
from barberpole.limits.page import page
from barberpole.sensor import Sensor
from barberpole.tables import describe, table_of

INTRODUCTION = """# Board and sensor files

Every key of `boards/<board>.toml`, `boards/drivers/<driver>.toml`, `boards/arrays/<array>.toml` and
`boards/sensors/<sensor>.toml`. Written by `make docs` from the tables in `barberpole.board_tables`,
`barberpole.driver_board`, `barberpole.arrays.array_file` and `barberpole.sensor`;
`barberpole.board_checks` says which values go together.
"""


APART = (Sensor, Member)  # tables of other files
LISTED_APART = ("members", "sensors")


def board_reference() -> str:
    """Markdown: one table of keys for each TOML table."""
    parts = [INTRODUCTION, "## Boards\n"]
    parts += [_keys(name, kind) for name, kind in _tables("board", Board)]
    parts += ["## Coil drivers\n", *(_keys(name, kind) for name, kind in _tables("board", Driver))]
    parts += ["## Arrays\n", "`boards/arrays/<array>.toml`; beside these, the tables of a board.\n"]
    parts += [_keys("array", Array), _keys("array.sensors", Member)]
    parts += ["## Sensors\n", *(_keys(name, kind) for name, kind in _tables("sensor", Sensor))]
    return "\n".join(parts)


def write_docs(folder: Path) -> None:
    """Write all pages into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    write_atomic(folder / "boards.md", board_reference())
    write_atomic(folder / "limits.md", page())
    write_atomic(folder / "bring-up.md", bring_up())


def _tables(name: str, kind: type) -> list[tuple[str, type]]:
    """The table and those inside it, depth first. A sensor is a file of its own."""
    prefix = "" if kind in (Board, Driver) else f"{name}."
    found = [(name, kind)]
    for field in dataclasses.fields(kind):
        inner = table_of(kind, field.name)
        if inner and inner not in APART:
            found += _tables(f"{prefix}{field.name}", inner)
    return found


def _keys(name: str, kind: type) -> str:
    rows = [f"### [{name}]\n", f"{(kind.__doc__ or '').splitlines()[0]}\n", "| key | unit | meaning |", "|---|---|---|"]
    for field in dataclasses.fields(kind):
        if field.name not in LISTED_APART and table_of(kind, field.name) in (None, Sensor):
            unit, meaning = _unit_and_meaning(describe(kind, field.name))
            rows.append(f"| `{field.name}` | {unit} | {meaning} |")
    return "\n".join(rows) + "\n"


def _unit_and_meaning(text: str) -> tuple[str, str]:
    """ "µs. Width of one pulse." is a unit and a meaning; without a unit the sentence is the meaning."""
    first, _, rest = text.partition(". ")
    return (first, rest) if rest and len(first) < 10 else ("", text)


if __name__ == "__main__":
    write_docs(Path(sys.argv[1]))
