"""`python -m mutation`: a sample of small faults in what computes; how many of them the tests notice.

The sample is a share of each module's mutants, picked by the hash of seed and fault: the same ones as long as their
lines are. Survivors that are known stand in survivors.md with the reason.
"""

import argparse
import functools
import hashlib
import itertools
import json
import math
import multiprocessing
import re
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from mutation.covering import Covering
from mutation.mutants import Mutant, compiles, mutants
from mutation.trial import UNTESTED, Verdict, copied, load_libraries, tried

REPOSITORY = Path(__file__).parents[2]
FOLDER = REPOSITORY / "build" / "mutation"
KNOWN = Path(__file__).with_name("survivors.md")
PACKAGES = ("host/barberpole/fit", "host/barberpole/diagnose", "host/barberpole/effects", "codegen/barberpole_codegen")
WANTED = 0.80
SHORT_S, LONG_S = 1.5, 25.0  # tests that are tried first, and all
ROOM = 5.0  # how much slower they may be
START_S = 15.0


def sample(share: float, seed: int, only: str) -> list[Mutant]:
    """A share of the mutants of every module, at least one."""
    taken = []
    for package in PACKAGES:
        for path in sorted((REPOSITORY / package).glob("*.py")):
            module = str(path.relative_to(REPOSITORY))
            made = mutants(module, path.read_text()) if only in module else []
            made.sort(key=functools.partial(_mixed, seed))
            taken += itertools.islice(filter(compiles, made), math.ceil(share * len(made)))
    return sorted(taken, key=lambda m: _mixed(seed, m))  # so that a part of it is a sample too


def _mixed(seed: int, mutant: Mutant) -> bytes:
    return hashlib.sha256(f"{seed} {mutant.key}".encode()).digest()


def known() -> dict[str, str]:
    """Key of a survivor -> why it lives."""
    lines = KNOWN.read_text().splitlines() if KNOWN.exists() else []
    found = (re.fullmatch(r"- (.*): (`.*` -> `.*`): (.*)", line) for line in lines)
    return {f"{m[1]}: {m[2]}": m[3] for m in found if m}


@functools.cache
def _place() -> tuple[Path, Covering]:
    """Of this worker: a copy to mutate, and which test runs what."""
    folder = TemporaryDirectory(prefix="mutation-")
    _place.keep = folder  # type: ignore[attr-defined]
    return copied(REPOSITORY, Path(folder.name) / "repository"), Covering(REPOSITORY, FOLDER)


def judged(mutant: Mutant) -> Verdict:
    """One mutant, in a worker."""
    folder, covering = _place()
    text = (REPOSITORY / mutant.module).read_text()
    tests = covering.tests(mutant.module, mutant.line, text, LONG_S)
    return tried(folder, mutant, list(_stages(tests, covering.seconds)))


def _stages(tests: list[str], seconds: dict[str, float]) -> Iterator[tuple[list[str], float]]:
    """The short ones by themselves: most faults are seen by those."""
    spent, cut = 0.0, 0
    while cut < min(len(tests), 40) and spent + seconds[tests[cut]] <= SHORT_S:
        spent += seconds[tests[cut]]
        cut += 1
    for part in (tests[:cut], tests[cut:]):
        if part:
            yield part, START_S + ROOM * sum(seconds[t] for t in part)


def run(made: list[Mutant], jobs: int) -> list[Verdict]:
    """Verdicts, in the order of the mutants."""
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    load_libraries()
    (FOLDER / "verdicts.jsonl").write_text("")
    found: dict[str, Verdict] = {}
    context = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(jobs, mp_context=context) as pool, Progress(*columns, transient=True) as bar:
        task = bar.add_task("mutants", total=len(made))
        for done in as_completed([pool.submit(judged, m) for m in made]):
            verdict = done.result()
            found[verdict.mutant.key] = verdict
            with (FOLDER / "verdicts.jsonl").open("a") as file:  # for whoever cannot wait for the end
                print(json.dumps([verdict.outcome, verdict.mutant.key, verdict.mutant.line, verdict.by]), file=file)
            bar.advance(task)
    return [found[m.key] for m in made]


def tell(verdicts: list[Verdict], every: bool) -> bool:
    """Print the figures and what survived; whether enough was killed."""
    reasons, living = known(), [v for v in verdicts if not v.is_killed]
    for package in PACKAGES:
        own = [v for v in verdicts if v.mutant.module.startswith(package)]
        if own:
            killed = sum(v.is_killed for v in own)
            print(f"{package:32} {killed:4} of {len(own):4} killed  {100 * killed / len(own):5.1f} %")
    share = 1.0 - len(living) / len(verdicts)
    print(f"{'all':32} {len(verdicts) - len(living):4} of {len(verdicts):4} killed  {100 * share:5.1f} %")
    for verdict in living:
        why = reasons.get(verdict.mutant.key, "NO TEST RUNS IT" if verdict.outcome == UNTESTED else "NOT EXPLAINED")
        print(f"- {verdict.mutant.key}: {why}")
    if every:
        for verdict in verdicts:
            print(f"{verdict.outcome:9} line {verdict.mutant.line:3} {verdict.mutant.key}  [{verdict.by}]")
    return share >= WANTED


def main() -> int:
    """0 where enough is killed."""
    parser = argparse.ArgumentParser(prog="mutation", description=__doc__)
    parser.add_argument("--share", type=float, default=0.03, help="of all mutants")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", default="", help="modules whose path contains this")
    parser.add_argument("--measure", action="store_true", help="find out anew which test runs what")
    parser.add_argument("--every", action="store_true", help="tell of every mutant what became of it")
    words = parser.parse_args()
    covering = Covering(REPOSITORY, FOLDER)
    if words.measure or not covering.is_there:
        covering.measure()
    covering.keep_present()
    return 0 if tell(run(sample(words.share, words.seed, words.only), words.jobs), words.every) else 1


if __name__ == "__main__":
    sys.exit(main())
