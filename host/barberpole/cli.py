"""The command line: exit 0 done, 1 the answer is "no", 2 bad input with one clear sentence on stderr."""

try:
    import barberpole.commands.interrupt as interrupt  # first: it stands for the time in which the others load
except KeyboardInterrupt:  # while that one loads
    raise SystemExit(130) from None

# isort: split
import sys
import warnings
from pathlib import Path

import typer

import barberpole.blas  # noqa: F401  (sets what numpy reads when it is loaded, so it comes first)
from barberpole import __version__
from barberpole.commands import (
    array,
    board,
    board_check,
    boards,
    calibrate,
    catalogue,
    challenge,
    characterise,
    demo,
    design,
    doctor,
    fleet,
    imcs,
    live,
    methods,
    report,
    trajectory,
    workbench,
)
from barberpole.commands.console import ERR, say
from barberpole.errors import BarberpoleError, must
from barberpole.files import FULL, cannot_write

interrupt.loaded()

BAD_INPUT = 2
INTERRUPTED = 130

app = typer.Typer(
    help="Calibrate AMR magnetometers: fit, find the missing effect, build the firmware, check the board.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
PANELS = {
    "A log and its model": (calibrate, catalogue, methods, challenge),
    "See it": (report, workbench),
    "A board": (demo, board, boards, board_check, live, trajectory, imcs, array),
    "A kind of sensor, and the apparatus": (characterise, design),
    "Many boards": (fleet,),
    "This machine": (doctor,),
}
for panel, modules in PANELS.items():
    commands, groups = len(app.registered_commands), len(app.registered_groups)
    for module in modules:
        module.register(app)
    for added in (*app.registered_commands[commands:], *app.registered_groups[groups:]):
        added.rich_help_panel = panel


@app.callback(invoke_without_command=True)
def _top(
    context: typer.Context,
    version: bool = typer.Option(False, "--version", help="Print the version and stop."),
) -> None:
    if version:
        print(__version__)
        raise typer.Exit


def main(arguments: list[str] | None = None) -> None:
    """Run one command and exit with its code."""
    code = run(sys.argv[1:] if arguments is None else arguments)
    interrupt.done()
    sys.exit(code)


def run(arguments: list[str]) -> int:
    """Run one command; its exit code. Errors that a user can mend become one line on stderr."""
    from numpy.linalg import LinAlgError

    from barberpole import plugins  # not needed by every command, but light beside numpy

    plugins.SAID[:] = [_runs]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # what they warn of shows in the answer, or is refused
            code = app(args=arguments, prog_name="barberpole", standalone_mode=False)
    except typer.Exit as leave:
        return leave.exit_code
    except typer.TyperException as usage:
        return _refuse(usage.format_message().replace("Value error, ", ""))
    except BarberpoleError as error:
        return _refuse(str(error))
    except (KeyboardInterrupt, typer.Abort):
        return INTERRUPTED
    except BrokenPipeError:
        return 0
    except OSError as error:  # where nobody could say more: a full disk, a folder that is a file
        if error.errno in FULL:
            return _refuse(str(cannot_write("what is written", error, error.filename or "")))
        return _refuse(must("a file or folder", "one that can be used", error.strerror or error, error.filename or ""))
    except LinAlgError as error:
        return _refuse(must("the log", "one that determines what is asked", f"readings without a solution: {error}"))
    except RecursionError:
        return _refuse(must("what was read", "a file of this kind", "parts within parts, too deep to read"))
    except MemoryError:
        return _refuse(must("what was read", "such as fits into the memory of this machine", "more than that"))
    return code if isinstance(code, int) else 0


def _runs(plugin: Path) -> None:
    say(f"barberpole: runs your own code in {plugin}, as the model file or the command line says", console=ERR)


def _refuse(sentence: str) -> int:
    if sentence.strip():  # none where a bare `barberpole` has shown its help
        say(f"barberpole: {_printable(' '.join(sentence.split()))}", console=ERR)
    return BAD_INPUT


def _printable(text: str) -> str:
    """A file's own words may hold what a terminal would obey."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
