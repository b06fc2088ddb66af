"""`python -m fuzzing.run --cases 10000`: damaged files through the command line, with a bar."""

import argparse
import contextlib
import io
import resource
import signal
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from barberpole.cli import run
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from fuzzing.damage import damaged, damages
from fuzzing.files import Kind, kinds

SLOW_S = 5.0  # of processor time
HANGING_S = 60  # of real time: what is still at work then is interrupted, and counts as hanging
BLOATED_KB = 400_000  # more memory than before
CODES = (0, 1, 2)
PLAIN = settings(database=None, deadline=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck))


class HangingError(BaseException):
    """A command did not end."""


@dataclass
class Bench:
    """Good files in a folder, and what was seen so far."""

    folder: Path
    kinds: list[Kind] = field(default_factory=list)
    exits: Counter = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)

    def words(self, kind: Kind, command: str) -> list[str]:
        """The command line on the damaged file."""
        names = {
            "FILE": self.folder / kind.name,
            "GOOD": self.folder / "good.csv",
            "GOODCAL": self.folder / "good.toml",
            "OUT.csv": self.folder / "out.csv",
            "PLUGGED": self.folder / "plugged.toml",
        }
        return [str(names.get(word, word)) for word in command.split()]

    def fault(self, kind: Kind, data: bytes, command: str) -> str:
        """Run one command on one damaged file: '' or what is wrong with how it ended."""
        (self.folder / kind.name).write_bytes(kind.wrapped(data))
        before, began = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
        said, wrong = io.StringIO(), io.StringIO()
        try:
            with contextlib.redirect_stdout(said), contextlib.redirect_stderr(wrong), _at_most(HANGING_S):
                code = run(self.words(kind, command))
        except HangingError:
            return f"did not end: {command}"
        except Exception:  # noqa: BLE001  (any at all is what is looked for)
            return f"traceback: {command}\n{traceback.format_exc(limit=-3)}"
        self.exits[code] += 1
        grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
        if code not in CODES:
            return f"exit {code}: {command}"
        if code == 2 and (not wrong.getvalue().strip() or "Traceback" in wrong.getvalue()):
            return f"exit 2 without one sentence: {command}\n{wrong.getvalue()[-500:]}"
        if time.process_time() - began > SLOW_S:
            return f"{time.process_time() - began:.1f} s of processor time: {command}"
        return f"{grown / 1024:.0f} MB more memory: {command}" if grown > BLOATED_KB else ""


@contextlib.contextmanager
def _at_most(seconds: int) -> Iterator[None]:
    def stop(*_: object) -> None:
        raise HangingError

    old = signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, old)


def bench(folder: Path) -> Bench:
    """Good files in a folder, each read once: what is loaded or compiled then is no fault of a damaged one."""
    made = Bench(folder, kinds(folder))
    (folder / "plugged.toml").write_text('effects = ["bias", "scale", "mine"]\nplugins = ["mine.py"]\n')
    for kind in made.kinds:
        for command in kind.commands:
            made.fault(kind, kind.good, command)
    made.exits.clear()
    return made


def search(made: Bench, cases: int, number: int, each=lambda: None) -> None:
    """Try so many damaged files. Faults are kept, the damaged file of each beside them; the search goes on."""

    @seed(number)
    @settings(
        max_examples=cases,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(st.sampled_from(made.kinds), st.integers(0, 1000), damages)
    def one(kind: Kind, which: int, how) -> None:
        data, command = damaged(kind.good, how), kind.commands[which % len(kind.commands)]
        fault = made.fault(kind, data, command)
        if fault:
            kept = made.folder / f"fault-{len(made.faults)}-{kind.name}"
            kept.write_bytes(kind.wrapped(data))
            made.faults.append(f"{kept.name}: {fault}")
        each()

    one()


def main() -> None:
    """Search with a bar; exit 1 if a fault was found."""
    parser = argparse.ArgumentParser(description="damaged files through the command line")
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="a folder for the files that make faults")
    chosen = parser.parse_args()
    screen = Console(stderr=True)
    columns = (TextColumn("fuzz"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with TemporaryDirectory() as name, Progress(*columns, console=screen) as bar:
        made = bench(Path(chosen.keep or name))
        task = bar.add_task("fuzz", total=chosen.cases)
        search(made, chosen.cases, chosen.seed, lambda: bar.advance(task))
    for fault in made.faults:
        print(fault)
    ends = ", ".join(f"exit {code} {count}" for code, count in sorted(made.exits.items()))
    print(f"{chosen.cases} damaged files: {len(made.faults)} faults; {ends}")
    raise SystemExit(1 if made.faults else 0)


if __name__ == "__main__":
    main()
