"""challenge new and challenge answer: find the hidden effect."""

from pathlib import Path
from typing import Annotated

import typer

from barberpole.commands.console import AS_JSON, OUT, print_json


def register(app: typer.Typer) -> None:
    """Add these commands to the roof."""
    group = typer.Typer(help="Find the hidden effect: a log in which something is wrong.", no_args_is_help=True)
    group.command()(new)
    group.command()(answer)
    app.add_typer(group, name="challenge")


def new(
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder to write.")],
    level: Annotated[int, typer.Option(help="1 (large, field known) to 5 (several, none, or foreign).")] = 1,
    seed: Annotated[int | None, typer.Option(help="Repeat a challenge.")] = None,
    as_json: bool = AS_JSON,
) -> None:
    """Write a log with an effect that nobody names, and a sealed answer."""
    from barberpole.challenge.game import LOG, MODEL, REST, SEALED
    from barberpole.challenge.game import new as write_challenge

    chosen = write_challenge(output, level, seed)
    if as_json:
        print_json(
            {"level": level, "log": str(output / LOG), "model": str(output / MODEL), "sealed": str(output / SEALED)}
        )
        return
    rest = f" --noise {output / REST}" if chosen.corner else ""
    OUT.print(f"level {level}: {chosen.text}")
    OUT.print(f"look at it:  barberpole diagnose {output / LOG} --model {output / MODEL}{rest}")
    OUT.print(f"then answer: barberpole challenge answer {output} EFFECT")


def answer(
    folder: Annotated[Path, typer.Argument(help="Folder of the challenge.")],
    effect: Annotated[list[str], typer.Argument(help="Effect, or several; none; or unknown (in no catalogue).")],
    as_json: bool = AS_JSON,
) -> int:
    """Open the sealed answer and tell how it went. Exit 1 if it is another."""
    from barberpole.challenge.game import answer as open_answer
    from barberpole.challenge.game import fall

    opened = open_answer(folder, tuple(effect))
    errors = fall(folder, opened)
    if as_json:
        said = {"right": opened.right, "hidden": list(opened.hidden), "given": list(opened.given)}
        print_json(said | {"heldout_lsb": errors})
    else:
        OUT.print("Right." if opened.right else "No.", style="bold", end=" ")
        OUT.print(f"Hidden was {', '.join(opened.hidden) or 'nothing'}.")
        if errors:
            OUT.print(f"held-out error with it in the model: {' -> '.join(f'{e:.3g}' for e in errors)} LSB")
        if len(opened.taken) < len(opened.hidden):
            OUT.print("No effect of the catalogue takes that: the answer was unknown.")
    return 0 if opened.right else 1
