"""Which tests run a line, by coverage.py's contexts: measured once, kept in build/mutation."""

import ast
import itertools
import json
import os
import subprocess
import sys
from collections import Counter
from functools import cached_property
from pathlib import Path

from coverage import CoverageData

SUITES = ("tests/host", "tests/codegen")
SETTINGS = """\
[run]
source_pkgs =
    barberpole
    barberpole_codegen
patch = subprocess
concurrency = thread, multiprocessing
parallel = true
sigterm = true
data_file = {data}
context = ${{BARBERPOLE_TEST-}}
disable_warnings = no-data-collected, module-not-imported, module-not-measured
"""


class Covering:
    """The tests that passed, by the lines that they run. `folder`: where the measurement is kept."""

    def __init__(self, repository: Path, folder: Path):
        self.repository, self.folder = repository, folder
        self._data = folder / "lines"
        self._times = folder / "times.json"

    @property
    def is_there(self) -> bool:
        """Whether it was measured."""
        return self._data.exists() and self._times.exists()

    def measure(self) -> None:
        """Run the suites under coverage.py; some minutes."""
        self.folder.mkdir(parents=True, exist_ok=True)
        for old in self.folder.glob("lines*"):
            old.unlink()
        settings = self.folder / "coverage.ini"
        settings.write_text(SETTINGS.format(data=self._data))
        python = [sys.executable, "-m", "coverage"]
        suites = [*python, "run", f"--rcfile={settings}", "-m", "pytest", "-n", "2", "-p", "mutation.contexts", *SUITES]
        environment = os.environ | {"BARBERPOLE_TIMES": str(self._times)}
        subprocess.run(suites, cwd=self.repository, env=environment, check=False)
        subprocess.run([*python, "combine", "-q", f"--rcfile={settings}"], cwd=self.repository, check=True)

    @cached_property
    def _read(self) -> CoverageData:
        data = CoverageData(str(self._data))
        data.read()
        return data

    def keep_present(self) -> None:
        """Forget tests that are no longer there: a name that pytest does not know would count as a fault noticed."""
        words = [sys.executable, "-m", "pytest", "--collect-only", *SUITES]
        said = subprocess.run(words, cwd=self.repository, capture_output=True, text=True, check=False).stdout
        present = set(said.splitlines())
        times = {test: s for test, s in json.loads(self._times.read_text()).items() if test in present}
        self._times.write_text(json.dumps(times))

    @cached_property
    def seconds(self) -> dict[str, float]:
        """Of each test that passed."""
        return json.loads(self._times.read_text())

    def tests(self, module: str, line: int, text: str, most_s: float) -> list[str]:
        """The tests that run a line of `text`, fastest first, `most_s` in sum; lines of an import: all of the file."""
        measured = next((name for name in self._read.measured_files() if name.endswith("/" + module)), None)
        if measured is None:
            return []
        by_line = self._read.contexts_by_lineno(measured)
        ran = Counter(test for tests in by_line.values() for test in tests if test in self.seconds)
        names = {c for number in _statement(text, line) for c in by_line.get(number, ())} & set(ran)
        if names and _is_called(text, line):
            ordered = sorted(names, key=lambda test: (self.seconds[test], test))
        else:  # first those that run most of the file
            ordered = sorted(ran, key=lambda test: (-ran[test], self.seconds[test], test))
        sums = itertools.accumulate(self.seconds[test] for test in ordered)
        return [test for at, (test, spent) in enumerate(zip(ordered, sums, strict=True)) if at == 0 or spent <= most_s]


def _is_called(text: str, line: int) -> bool:
    """Whether the line is in the body of a function, and not run by whoever imports the module."""
    functions = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef)]
    return any(node.body[0].lineno <= line <= (node.end_lineno or 0) for node in functions)


def _statement(text: str, line: int) -> range:
    """Lines of the innermost statement that the line is part of; of compound ones, their head."""
    found = range(line, line + 1)
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.stmt):
            continue
        body = getattr(node, "body", None)
        end = body[0].lineno - 1 if body else node.end_lineno or node.lineno
        if node.lineno <= line <= max(end, node.lineno):
            found = range(node.lineno, max(end, node.lineno) + 1)
    return found
