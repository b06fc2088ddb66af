"""A mutant in a copy of the repository, and tests on it in a process that has the libraries loaded already."""

import contextlib
import itertools
import os
import resource
import shutil
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from mutation.mutants import Mutant

# What the tests load and no mutant can reach, loaded once: half of what a short run of pytest costs.
HEAVY = """
    numpy scipy.optimize scipy.signal scipy.stats scipy.linalg scipy.special scipy.sparse scipy.spatial scipy.ndimage
    pyarrow.csv pyarrow.parquet pyarrow.compute pydantic typer rich.console rich.progress hypothesis tomlkit jinja2
    plotly.graph_objects plotly.io sympy json asyncio typer.testing
"""
LEFT_OUT = (".git", ".venv", "build", ".hypothesis", "__pycache__", ".pytest_cache", ".ruff_cache")
KILLED, SURVIVED, LATE, UNTESTED = "killed", "survived", "too slow", "no test"


@dataclass(frozen=True)
class Verdict:
    """What became of a mutant, and by which test."""

    mutant: Mutant
    outcome: str
    by: str = ""

    @property
    def is_killed(self) -> bool:
        """Whether something noticed it; a test that no longer ends does."""
        return self.outcome in (KILLED, LATE)


def load_libraries() -> None:
    """Before the first fork."""
    for name in HEAVY.split():
        with contextlib.suppress(ImportError):
            __import__(name)


def copied(repository: Path, folder: Path) -> Path:
    """A copy of the repository."""
    shutil.copytree(repository, folder, symlinks=True, ignore=shutil.ignore_patterns(*LEFT_OUT))
    return folder


def tried(folder: Path, mutant: Mutant, stages: list[tuple[list[str], float]]) -> Verdict:
    """Run tests on a mutant until one notices; `stages`: tests and what they may take of processor time, s."""
    path = folder / mutant.module
    whole = path.read_text()
    _put(path, mutant.text)
    try:
        for tests, limit_s in stages:
            code, by = forked(folder, tests, limit_s)
            if code:
                return Verdict(mutant, KILLED if code > 0 else LATE, by)
        return Verdict(mutant, SURVIVED if stages else UNTESTED)
    finally:
        _put(path, whole)


def _put(path: Path, text: str) -> None:
    """Write a module, with a time that it never had: compiled files of another text must not count as its own."""
    path.write_text(text)
    moment = next(_moments)
    os.utime(path, (moment, moment))


_moments = itertools.count(1_000_000_000)


def forked(folder: Path, tests: list[str], limit_s: float) -> tuple[int, str]:
    """(0: all passed, negative: cut off; the test that failed) of pytest in a process of its own."""
    said, say = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(said)
        _be_pytest(folder, tests, limit_s, say)
    os.close(say)
    status = _waited(pid, time.monotonic() + 20 * limit_s)
    with os.fdopen(said) as text:
        by = text.read()
    return os.waitstatus_to_exitcode(status), by


def _waited(pid: int, until: float) -> int:
    while True:
        found, status = os.waitpid(pid, os.WNOHANG)
        if found:
            break
        if time.monotonic() > until:
            os.killpg(pid, signal.SIGKILL)
        time.sleep(0.02)
    with contextlib.suppress(ProcessLookupError):  # what it has started and left behind
        os.killpg(pid, signal.SIGKILL)
    return status


class _First:
    """Tells the pipe which test failed first."""

    def __init__(self, say: int):
        self._say = say

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Only the first: pytest ends there."""
        if report.outcome == "failed":
            os.write(self._say, report.nodeid.encode())


def _be_pytest(folder: Path, tests: list[str], limit_s: float, say: int) -> None:
    code = 3
    try:
        os.setsid()
        limit = round(limit_s) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 1))
        os.dup2(os.open(os.devnull, os.O_RDWR), 1)
        os.dup2(1, 2)
        os.chdir(folder)
        sources = [str(folder / name) for name in ("host", "codegen", "tests")]
        os.environ["PYTHONPATH"] = os.pathsep.join(sources)
        sys.path[:] = [*sources, *(p for p in sys.path if not _is_ours(p))]
        code = int(pytest.main(["-x", "-q", "-p", "no:cacheprovider", *tests], plugins=[_First(say)]))
    finally:
        os._exit(code)


def _is_ours(place: str) -> bool:
    """Whether the package could come from there, and not from the copy."""
    return any((Path(place) / name).is_dir() for name in ("barberpole", "barberpole_codegen", "mutation"))
