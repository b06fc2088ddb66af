"""board check: whether a board file can be built, pin by pin."""

from typing import Annotated

import typer

from barberpole.commands.console import AS_JSON, OUT, print_json, say, table

app = typer.Typer(help="What a board file asks of its parts.", no_args_is_help=True)


def register(roof: typer.Typer) -> None:
    """Add `board` and what is below it."""
    roof.add_typer(app, name="board")


@app.callback()
def _group() -> None:
    """A group, though it has one command only."""


@app.command()
def check(
    file: Annotated[str, typer.Argument(help="Board name or .toml.")],
    as_json: bool = AS_JSON,
) -> None:
    """Explain every conflict of pins, buses, timers, DMA, currents and times; exit 1 where there is one."""
    from barberpole.arrays.array_file import read_array_board
    from barberpole.arrays.names import is_array
    from barberpole.board import read_board
    from barberpole.board_checks import faults
    from barberpole.errors import InputError

    board = read_array_board(file) if is_array(file) else read_board(file)
    found = faults(board)
    try:
        from barberpole.wiring import uses

        wired = uses(board)
    except InputError:  # the MicroPython board is not known, and says so among the faults
        wired = []
    if as_json:
        pins = [{"key": u.key, "pin": u.name, "port": u.port, "function": u.function} for u in wired]
        print_json({"board": board.name, "passed": not found, "conflicts": found, "pins": pins})
    else:
        _print(board.name, found, wired)
    if found:
        raise typer.Exit(1)


def _print(name: str, found: list[str], wired: list) -> None:
    shown = table(f"pins of {name}", "key", "pin", "port", "function")
    for use in wired:
        shown.add_row(use.key, use.name, use.port, use.function)
    OUT.print(shown)
    for conflict in found:
        say(f"conflict: {conflict}", "red")
    if not found:
        OUT.print("no conflict")
