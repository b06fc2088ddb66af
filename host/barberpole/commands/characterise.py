"""characterise: the data sheet of one sensor from its logs."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from barberpole import __version__
from barberpole.characterise.page import uncertain, write_sheet
from barberpole.characterise.sheet import Sheet, make_sheet
from barberpole.commands.console import AS_JSON, OUT, notes, print_json, table
from barberpole.log import read_log


def register(app: typer.Typer) -> None:
    """Add this command to the roof."""
    app.command()(characterise)


def characterise(
    logs: Annotated[list[Path], typer.Argument(help="Logs of one sensor: linearity, rest, sines, turn-over, ...")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Where to write the page (.html).")] = None,
    name: Annotated[str, typer.Option(help="Name of the sensor, for the title.")] = "sensor",
    as_json: bool = AS_JSON,
) -> None:
    """One sensor's data sheet, in the form of the article's table 1, with uncertainties."""
    read = [read_log(path) for path in logs]
    sheet = make_sheet(read)
    if output:
        hashes = "\n".join(f"{log.path.name}  {log.sha256}" for log in read)
        write_sheet(output, f"Data sheet: {name}", sheet, f"barberpole {__version__}\n{hashes}")
    if as_json:
        print_json(_json(sheet))
        return
    notes(sheet.notes)
    shown = table(f"data sheet of {name}", "quantity", "case", "value", "unit")
    for f in sheet.figures:
        shown.add_row(f.quantity, f.case, uncertain(f.value, f.stderr), f.unit)
    OUT.print(shown)
    if output:
        OUT.print(f"page written to {output}")


def _json(sheet: Sheet) -> dict:
    """The figures as objects; an error that is not known is null."""
    rows = [
        {
            "quantity": f.quantity,
            "case": f.case,
            "value": f.value,
            "stderr": f.stderr if np.isfinite(f.stderr) else None,
            "unit": f.unit,
        }
        for f in sheet.figures
    ]
    return {"figures": rows, "notes": list(sheet.notes)}
