"""effects and effect new: the catalogue, and a user's own physics."""

from pathlib import Path
from typing import Annotated

import typer

from barberpole.commands import show
from barberpole.commands.console import AS_JSON, print_json, say
from barberpole.effects import ALIASES, STACK, alias_notes
from barberpole.plugins import new_plugin


def register(app: typer.Typer) -> None:
    """Add these commands to the roof."""
    app.command()(effects)
    group = typer.Typer(help="A user's own effect.", no_args_is_help=True)
    group.command()(new)
    group.callback()(lambda: None)  # keeps `new` a word of its own
    app.add_typer(group, name="effect")


def effects(as_json: bool = AS_JSON) -> None:
    """The catalogue of physical effects, in physical order."""
    if as_json:
        listed = [{"name": e.name, "equation": e.equation, "source": e.source, "summary": e.summary} for e in STACK]
        print_json({"effects": listed, "aliases": ALIASES})
    else:
        show.catalogue(STACK)
        for sentence in alias_notes(tuple(ALIASES)):
            say(sentence)


def new(
    name: Annotated[str, typer.Argument(help="Name of the effect: small letters, digits and _.")],
    folder: Annotated[Path, typer.Option(help="Where to write the file.")] = Path(),
    as_json: bool = AS_JSON,
) -> None:
    """Write a plugin file with the equation to fill in."""
    path = new_plugin(name, folder)
    if as_json:
        print_json({"path": str(path)})
        return
    say(f'{path} written; fill in forward, then list it in the model file: plugins = ["{path.name}"]')
