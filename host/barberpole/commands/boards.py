"""boards: what `build`, `twin` and `demo` know by name, and where those files lie to be copied."""

from pathlib import Path
from typing import Any

import typer

from barberpole import paths
from barberpole.commands.console import AS_JSON, OUT, print_json, table
from barberpole.tables import read_toml

ROLES = {"": "sensor", "arrays": "array", "drivers": "coil driver"}


def register(app: typer.Typer) -> None:
    """Add this command to the roof."""
    app.command()(boards)


def boards(as_json: bool = AS_JSON) -> None:
    """The boards and sensors known by name, and the folder of their files: copy one for a board of your own."""
    folder = paths.boards()
    known = [_row(path, role) for part, role in ROLES.items() for path in sorted((folder / part).glob("*.toml"))]
    sensors = sorted(path.stem for path in (folder / "sensors").glob("*.toml"))
    if as_json:
        print_json({"folder": str(folder), "boards": known, "sensors": sensors})
        return
    shown = table("boards", "name", "is a", "microcontroller", "sensor", "converter")
    for row in known:
        shown.add_row(*(row[key] for key in ("name", "role", "mcu", "sensor", "adc")))
    OUT.print(shown)
    OUT.print(f"sensors: {', '.join(sensors)}")
    OUT.print(f"files in {folder}; a board of your own: copy one, change it, `barberpole board check FILE.toml`")


def _row(path: Path, role: str) -> dict[str, Any]:
    tables = read_toml(path, "the board file")
    head = tables.get("array", {}) | tables.get("board", {})
    said = {key: str(head.get(key, "")) for key in ("mcu", "micropython_board", "sensor")}
    return {"name": path.stem, "role": role, **said, "adc": str(tables.get("adc", {}).get("part", ""))}
