"""monitor, command: talking to a board while it streams."""

import time
from enum import StrEnum
from typing import Annotated, Any

import typer

from barberpole.commands.console import AS_JSON, OUT, print_json, table

PortOption = Annotated[str, typer.Option("--port", help="Serial port, for example /dev/ttyACM0.")]


class Asked(StrEnum):
    """What `barberpole command` can ask for."""

    STATUS = "status"
    SELFCAL = "selfcal"
    STREAM = "stream"
    STOP = "stop"
    FACTORY_RESET = "factory-reset"
    READ_CAL = "read-cal"
    READ_LOG = "read-log"


LINES = {Asked.SELFCAL: "selfcal now", Asked.FACTORY_RESET: "factory reset"}


def register(app: typer.Typer) -> None:
    """Add these commands to the roof."""
    for name in (monitor, command):
        app.command()(name)


def monitor(
    port: PortOption,
    seconds: Annotated[float | None, typer.Option(min=0.5, help="Stop after so many seconds.")] = None,
    as_json: bool = typer.Option(False, "--json", help="Print one JSON object a second."),
) -> None:
    """Show live what a board streams: field, offsets, temperature, verdict, rate and losses; Ctrl-C ends it."""
    from contextlib import nullcontext

    from rich.live import Live

    from barberpole.link.listen import listening
    from barberpole.link.monitor import seconds as heard_seconds

    until = time.monotonic() + seconds if seconds is not None else float("inf")
    with listening(port) as board, nullcontext() if as_json else Live(console=OUT, auto_refresh=False) as live:
        for second in heard_seconds(board):
            if live is None:
                print_json(second.to_json())
            else:
                live.update(_shown(port, second), refresh=True)
            if time.monotonic() >= until:
                return


def _shown(port: str, second: Any):
    shown = table(f"{port}   calibration {second.calibration or '?'}   {second.t_s:.1f} s", "", "x", "y", "z")
    shown.add_row("field, µT", *(f"{v:.3f}" for v in second.field_ut))
    shown.add_row("SET/RESET offset, LSB", *(f"{v:.1f}" for v in second.offset_lsb))
    shown.add_row("|B|, µT", f"{second.b_ut:.3f}")
    shown.add_row("temperature, °C", f"{second.temp_c:.2f}")
    shown.add_row("supply, V", f"{second.supply_v:.2f}")
    shown.add_row("rows a second", f"{second.rate_hz:.1f}")
    shown.add_row("frames lost", str(second.lost))
    verdict = {True: "accepted", False: "refused", None: "unknown"}[second.accepted]
    shown.add_row("self-calibration", verdict, second.in_force, ", ".join(second.reasons))
    if second.events:
        shown.add_row("events", *second.events[-3:])
    return shown


def command(
    asked: Annotated[Asked, typer.Argument(help="What the board is asked for.")],
    port: PortOption,
    as_json: bool = AS_JSON,
) -> None:
    """Ask a running board: its status, a self-calibration now, its calibration or log; it streams on.

    Exit code 1: the board says no (a self-calibration was refused, a stream cannot start).
    """
    from barberpole.link.listen import ask

    answers = ask(port, LINES.get(asked, asked.value.replace("-", " ")))
    last = answers[-1]
    if asked == Asked.READ_LOG:
        last["log"] = [answer["entry"] for answer in answers if "entry" in answer]
    if as_json:
        print_json(last)
    else:
        OUT.print(_answer_table(last))
    if not last["done"]:
        raise typer.Exit(1)


def _answer_table(answer: dict[str, Any]):
    shown = table(answer["command"], "what", "value")
    for name, value in answer.items():
        if name == "log":
            for entry in value:
                shown.add_row(f"boot {entry.get('boot')}, {entry.get('t_s', 0):.1f} s", _sentence(entry))
        elif isinstance(value, dict):
            for inner, what in value.items():
                shown.add_row(f"{name}.{inner}", _text(what))
        elif name != "command":
            shown.add_row(name, _text(value))
    return shown


def _sentence(entry: dict[str, Any]) -> str:
    extra = {k: v for k, v in entry.items() if k not in ("boot", "t_s", "code", "name", "text", "command")}
    return f"{entry.get('name')}: {entry.get('text')} " + " ".join(f"{k}={_text(v)}" for k, v in extra.items())


def _text(value: Any) -> str:
    if isinstance(value, list):
        return " ".join(_text(v) for v in value) or "none"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
