"""`python -m fuzzing.guided --seconds 60`: a coverage-guided search (atheris) over every reader, two at a time.

A finding stops its reader's search: the input is kept, and the same command with `--only NAME --input FILE` repeats it.
"""

import argparse
import contextlib
import importlib.util
import io
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

KEPT = Path("build/fuzz")
LONGEST = 20_000  # bytes of an input
SLOW_S = 5
BLOATED_MB = 1000  # of the whole process
LOOK_S = 0.5
SAID = 4000  # characters of a finding
INSTRUMENTED = ("barberpole", "tomllib", "csv")
SKIPPED = (
    f"coverage-guided part skipped: there is no atheris for Python {sys.version_info.major}.{sys.version_info.minor}"
)


def search(name: str, corpus: Path, flags: list[str]) -> None:
    """Search one reader in this process; it ends with the process."""
    import atheris

    with atheris.instrument_imports(include=list(INSTRUMENTED)):
        from fuzzing.targets import targets
    with tempfile.TemporaryDirectory() as folder:
        read = targets(Path(folder))[name].read
        atheris.Setup([sys.argv[0], *flags, str(corpus)], atheris.instrument_func(read))
        atheris.Fuzz()


def names_and_seeds() -> dict[str, list[bytes]]:
    """Every reader with what it begins with."""
    from fuzzing.files import kinds
    from fuzzing.targets import seeds, targets

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with contextlib.redirect_stdout(io.StringIO()):
            made = kinds(folder)
        return {target: seeds(of, made) for target, of in targets(folder).items()}


def _begun(name: str, begin: list[bytes], chosen: argparse.Namespace) -> subprocess.Popen:
    corpus = chosen.keep / "corpus" / name
    corpus.mkdir(parents=True, exist_ok=True)
    for at, data in enumerate(begin):
        (corpus / f"seed-{at}").write_bytes(data)
    flags = [f"-max_total_time={chosen.seconds}", f"-seed={chosen.seed}", f"-max_len={LONGEST}", f"-timeout={SLOW_S}"]
    flags += [f"-rss_limit_mb={BLOATED_MB}", f"-artifact_prefix={chosen.keep}/{name}-", "-print_final_stats=1"]
    words = [sys.executable, "-m", "fuzzing.guided", "--search", name, "--corpus", str(corpus), *flags]
    with _said(name, chosen).open("wb") as said:
        return subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=said)


def _said(name: str, chosen: argparse.Namespace) -> Path:
    return chosen.keep / f"{name}.txt"


def _ended(begin: dict[str, list[bytes]], chosen: argparse.Namespace) -> Iterator[tuple[str, int]]:
    """Name and exit code of every search, as many at a time as there are cores."""
    waiting, at_work = list(begin), {}
    while waiting or at_work:
        while waiting and len(at_work) < (os.cpu_count() or 1):
            at_work[waiting[0]] = _begun(waiting[0], begin[waiting[0]], chosen)
            del waiting[0]
        over = [name for name, process in at_work.items() if process.poll() is not None]
        for name in over:
            yield name, at_work.pop(name).returncode
        if not over:
            time.sleep(LOOK_S)


def main() -> None:
    """Search every reader for so many seconds; exit 1 if one has a finding."""
    parser = argparse.ArgumentParser(description="coverage-guided search over every reader of files")
    parser.add_argument("--seconds", type=int, default=30, help="for each reader")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", action="append", help="one reader, or several")
    parser.add_argument("--input", type=Path, help="read this one input with the reader of --only, to see it again")
    parser.add_argument("--keep", type=Path, default=KEPT)
    parser.add_argument("--search", help=argparse.SUPPRESS)
    parser.add_argument("--corpus", type=Path, help=argparse.SUPPRESS)
    chosen, flags = parser.parse_known_args()
    if chosen.input:
        again(chosen.only[0], chosen.input)
    elif importlib.util.find_spec("atheris") is None:
        print(SKIPPED)
    elif chosen.search:
        search(chosen.search, chosen.corpus, flags)
    else:
        raise SystemExit(_all(chosen))


def _figures(said: str) -> str:
    """How many inputs, and how many branches of the code they reached."""
    lines = said.splitlines()
    runs = next((line.split()[-1] for line in lines if "number_of_executed_units" in line), "?")
    cover = next((line.split("cov: ")[1].split()[0] for line in reversed(lines) if "cov: " in line), "?")
    return f"{runs:>8} inputs, {cover:>5} branches"


def again(name: str, path: Path) -> None:
    """One input once more. Raises what the reader raises."""
    from fuzzing.targets import targets

    with tempfile.TemporaryDirectory() as folder:
        targets(Path(folder))[name].read(path.read_bytes())
    print(f"{name}: {path} is read, or refused in a sentence")


def _all(chosen: argparse.Namespace) -> int:
    begin, found, began = names_and_seeds(), 0, time.monotonic()
    begin = {name: data for name, data in begin.items() if not chosen.only or name in chosen.only}
    for name, code in _ended(begin, chosen):
        said = _said(name, chosen).read_text(errors="replace")
        print(f"{name:18} {_figures(said)}{'' if code == 0 else ', A FINDING'}", flush=True)
        if code:
            found += 1
            print(said[-SAID:])
    print(
        f"coverage-guided: {len(begin)} readers, {found} findings, {time.monotonic() - began:.0f} s, seed {chosen.seed}"
    )
    return 1 if found else 0


if __name__ == "__main__":
    main()
