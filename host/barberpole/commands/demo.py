"""demo: the whole job on the emulated board."""

import tempfile
import time
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from barberpole.commands.console import AS_JSON, ERR, OUT, print_json, say, table
from barberpole.errors import InputError, must
from barberpole.files import cannot_write


def register(app: typer.Typer) -> None:
    """Add this command to the roof."""
    app.command()(demo)


def demo(
    hidden: Annotated[str, typer.Option(help="Effect that the model lacks, or none.")] = "cross_field",
    board: Annotated[str, typer.Option(help="Board name or .toml.")] = "pybv11",
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder to keep everything in.")] = None,
    seed: Annotated[int, typer.Option(help="Noise of the emulated board.")] = 0,
    as_json: bool = AS_JSON,
) -> int:
    """Generate, deploy with mpremote, self-calibrate, verify, find the missing effect, add it: the error falls."""
    from barberpole.demo.page import write_demo_page
    from barberpole.demo.story import FACTORY_FIELDS, HIDEABLE, ROWS_PER_FIELD, TODAY_FIELDS, Story

    if hidden not in HIDEABLE:
        raise InputError(must("the hidden effect", f"one of {', '.join(HIDEABLE)}", repr(hidden)))
    folder = _writable(output) if output else Path(tempfile.mkdtemp(prefix="barberpole-demo-"))
    rows = (FACTORY_FIELDS + 2 * TODAY_FIELDS) * ROWS_PER_FIELD
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    began = time.monotonic()
    with Progress(*columns, console=ERR, transient=True, disable=not ERR.is_terminal) as bar:
        task = bar.add_task("demo", total=rows)

        def chapter(title: str) -> None:
            bar.console.print(title, style="bold")
            bar.update(task, description=title[:48])

        def detail(text: str) -> None:
            say(f"        {text}", "dim", hang=8, console=bar.console)

        outcome = Story(board, hidden, folder, seed, chapter, detail, lambda n: bar.advance(task, n)).run()
    page = folder / "demo.html"
    write_demo_page(outcome, page)
    if as_json:
        print_json(outcome.to_json())
    else:
        _show(outcome, page, time.monotonic() - began)
    return 0 if outcome.named == (None if hidden == "none" else hidden) else 1


def _writable(folder: Path) -> Path:
    try:
        if not folder.exists():
            folder.mkdir(parents=True)
            (folder / ".gitignore").write_text("*\n")  # made inside a checkout, it is no part of it: linters pass it by
        elif not folder.is_dir():
            raise FileExistsError(0, "a file")
    except OSError as error:
        raise cannot_write("the output", error, folder) from None
    return folder


def _show(outcome, page: Path, seconds: float) -> None:
    answer = outcome.to_json()
    missing = f"{outcome.named} is missing" if outcome.named else "nothing is missing"
    verdict = f"\nHidden from the model: {outcome.hidden}. Verdict: {answer['verdict']}; {missing}."
    say(verdict, "bold")
    shown = table("", "error, rms", "before", "after", "noise")
    lsb_per_ut = float(sum(outcome.before.session.truth["scale_lsb_per_ut"]) / 3)
    for name, key in (("on the log", "rms"), ("held out", "heldout")):
        old, new, noise = answer[f"{key}_before_lsb"], answer[f"{key}_after_lsb"], answer["noise_lsb"]
        shown.add_row(f"{name}, LSB", f"{old:.1f}", f"{new:.1f}", f"{noise:.1f}")
        shown.add_row(f"{name}, nT", *(f"{1000 * v / lsb_per_ut:.2f}" for v in (old, new, noise)))
    shown.add_row("computed on the board, nT", f"{outcome.before.rms_nt:.2f}", f"{outcome.after.rms_nt:.2f}", "")
    old_gain, new_gain = (", ".join(f"{ppm:+.0f}" for ppm in b.gain_error_ppm) for b in (outcome.before, outcome.after))
    shown.add_row("gains x, y, z against the truth, ppm", old_gain, new_gain, "")
    OUT.print(shown)
    say(f"self-calibration at power-up: {answer['selfcal_s']:.2f} s of board time; demo: {seconds:.0f} s")
    say(f"open {page}")
