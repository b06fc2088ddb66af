"""workbench: the local web page."""

from pathlib import Path
from typing import Annotated

import typer

from barberpole.commands.console import AS_JSON, OUT, print_json
from barberpole.errors import InputError, must


def register(app: typer.Typer) -> None:
    """Add this command to the roof."""
    app.command()(workbench)


def workbench(
    log: Annotated[Path | None, typer.Argument(help="A log to begin with: CSV, Parquet or board records.")] = None,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port on 127.0.0.1; 0: any that is free.")] = 8642,
    folder: Annotated[Path, typer.Option(help="Where logs are found and results written; nothing else is.")] = Path(),
    browser: Annotated[bool, typer.Option(help="Open the page in a browser.")] = True,
    as_json: bool = AS_JSON,
) -> None:
    """Open the page to think in: model against measurement, suspects, trials, a board to watch. Ctrl-C ends it."""
    if log is not None and not log.is_file():
        raise InputError(must("the log", "a file that can be read", "none", log))
    from barberpole.workbench import server  # here: slow to load

    free = server.free_port(port)
    url = server.url(free)
    said = {"url": url, "folder": str(folder.resolve())}
    ready = (lambda: print_json(said)) if as_json else (lambda: OUT.print(f"{url}  (Ctrl-C ends it)"))
    server.serve(folder, log and log.resolve(), free, browser, ready)
