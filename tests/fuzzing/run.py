"""`python -m fuzzing.run --cases 10000`: damaged files through the command line, with a bar."""

import argparse
import contextlib
import gc
import io
import os
import select
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from fuzzing.case import Case, case, good_cases
from fuzzing.child import Child, Outcome, start
from fuzzing.files import Kind, kinds

KEPT = Path("build/fuzz")
LOOK_S = 0.5  # how often is looked whether one hangs


@dataclass
class Bench:
    """Good files in a folder, and what was seen so far."""

    folder: Path
    kinds: list[Kind]
    exits: Counter = field(default_factory=Counter)
    faults: list[Outcome] = field(default_factory=list)

    @property
    def good(self) -> Path:
        return self.folder / "good"


def bench(folder: Path) -> Bench:
    """Good files in a folder, each read once here: what is loaded or compiled then is no fault of a damaged one.

    Raises RuntimeError where a command refuses a good file.
    """
    from barberpole.cli import run

    (folder / "good").mkdir()
    made = Bench(folder, kinds(folder / "good"))
    for at, one in enumerate(good_cases(made.kinds)):
        here = folder / f"good-{at}"
        here.mkdir()
        one.write(here)
        code = run(one.words(here, made.good))
        made.exits[code] += 1
        if code == 2:
            raise RuntimeError(f"exit 2 on the good {one.kind.name}: {one.command}")
    made.exits.clear()
    gc.collect()
    gc.freeze()  # so that a child's collector does not copy what it shares with us
    return made


def search(made: Bench, cases: Iterable[Case], each: Callable[[Outcome], None] = lambda _: None) -> None:
    """Try these cases, as many at a time as there are cores; faults are kept, and the search goes on."""
    for outcome in _ended(made, iter(cases)):
        made.exits[outcome.code] += 1
        if outcome.fault:
            made.faults.append(outcome)
        each(outcome)


def _ended(made: Bench, cases: Iterator[Case]) -> Iterator[Outcome]:
    at_work: list[Child] = []
    while True:
        while len(at_work) < (os.cpu_count() or 1) and (one := next(cases, None)) is not None:
            at_work.append(start(one, made.folder / one.name, made.good))
        if not at_work:
            return
        ready, _, _ = select.select(at_work, [], [], LOOK_S)
        for child in ready or [child for child in at_work if child.overdue]:
            at_work.remove(child)
            yield child.end()


def told(outcome: Outcome, kept: Path) -> str:
    """A fault in words: what to keep, what to run, how to see it again. The damaged file is kept."""
    kept.mkdir(parents=True, exist_ok=True)
    one = outcome.case
    (kept / one.name).write_bytes(one.content)
    again = f"python -m fuzzing.run --seed {one.seed} --only {one.number}"
    return f"{kept / one.name}: {one.command}\n  again: {again}\n  {outcome.fault}"


def _numbers(chosen: argparse.Namespace) -> range:
    return range(chosen.cases) if chosen.only is None else range(chosen.only, chosen.only + 1)


def main() -> None:
    """Search with a bar; exit 1 if a fault was found."""
    parser = argparse.ArgumentParser(description="damaged files through the command line")
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, help="the number of one case, to see it again")
    parser.add_argument("--keep", type=Path, default=KEPT, help="folder for the files that make faults")
    chosen = parser.parse_args()
    numbers = _numbers(chosen)
    columns = (TextColumn("fuzz"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with TemporaryDirectory() as name:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            made = bench(Path(name))
        # no thread of the bar may be at work when a child is forked
        with Progress(*columns, console=Console(stderr=True), auto_refresh=False) as bar:
            task = bar.add_task("fuzz", total=len(numbers))

            def each(outcome: Outcome) -> None:
                bar.update(task, advance=1, refresh=True)
                if outcome.fault:
                    print(told(outcome, chosen.keep), flush=True)
                elif chosen.only is not None:
                    print(f"{outcome.case.command}\nexit {outcome.code}\n{outcome.said}")

            search(made, (case(made.kinds, chosen.seed, number) for number in numbers), each)
    ends = ", ".join(f"exit {code} {count}" for code, count in sorted(made.exits.items(), key=str))
    print(f"seed {chosen.seed}: {len(numbers)} damaged files, {len(made.faults)} faults; {ends}")
    raise SystemExit(1 if made.faults else 0)


if __name__ == "__main__":
    main()
