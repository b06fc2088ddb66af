"""`python -m lines`: the share of lines that the tests run, by package; fails below what is asked for.

One run of the whole suite in a copy of the repository: the host and the generator under coverage.py, in this and in
every process that the tests start (commands, emulated boards, workers); the firmware with markers, in MicroPython. What
CPython runs of the firmware, on the model of the registers, is not counted, nor are the shims, which are no firmware.
Viper functions are machine code and carry markers like all others; the interpreter compiles them for the PC.
"""

import argparse
import os
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from tempfile import TemporaryDirectory

from coverage import Coverage, CoverageData

from lines.copy import ALONE, marked_copy

REPOSITORY = Path(__file__).parents[2]
WANTED = {"host/barberpole": 0.92, "codegen/barberpole_codegen": 0.92, "firmware": 0.90}
WORST = 12
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
omit = */twin/shims/*
disable_warnings = no-data-collected, module-not-imported, module-not-measured
[paths]
source =
    {repository}
    {copy}
"""
# They hold sizes, which markers change.
LEFT_OUT = (
    "tests/twin/test_port.py::test_full_flash_is_an_error_of_the_board",
    "tests/twin/test_port.py::test_memory_is_the_boards_and_not_the_pcs",
    "tests/codegen/test_hot.py::test_operations_are_counted_in_the_source",
)


def measured(folder: Path, words: list[str]) -> Coverage:
    """Run the tests in a marked copy in `folder`; lines of host, generator and firmware in one measurement."""
    copy, data, record = folder / "copy", folder / "lines", folder / "passed"
    markers = marked_copy(REPOSITORY, copy, record)
    settings = folder / "coverage.ini"
    settings.write_text(SETTINGS.format(data=data, repository=REPOSITORY, copy=copy))
    sources = os.pathsep.join(str(copy / name) for name in ("host", "codegen", "tests"))
    python = [sys.executable, "-m", "coverage"]
    left_out = [word for test in LEFT_OUT for word in ("--deselect", test)]
    suite = [*python, "run", f"--rcfile={settings}", "-m", "pytest", "-n", "2", *left_out, *words]
    places = {"PYTHONPATH": sources, "MICROPYPATH": f".frozen:{copy / ALONE}"}
    subprocess.run(suite, cwd=copy, env=os.environ | places, check=False)
    subprocess.run([*python, "combine", "-q", f"--rcfile={settings}"], cwd=REPOSITORY, check=True)
    found = CoverageData(str(data))
    found.read()
    passed = markers.lines(record.read_bytes())
    found.add_lines({str(REPOSITORY / name): lines for name, lines in passed.items()})
    found.write()
    made = Coverage(data_file=str(data), config_file=False)
    made.load()
    return made


def counted(coverage: Coverage) -> dict[str, tuple[int, list[int]]]:
    """Of every file: how many statements, and the lines of those that were not run."""
    files = [path for top in WANTED for path in sorted((REPOSITORY / top).rglob("*.py")) if "shims" not in path.parts]
    found = {}
    for path in files:
        _, statements, _, missing, _ = coverage.analysis2(str(path))
        found[str(path.relative_to(REPOSITORY))] = (len(statements), missing)
    return found


def tell(found: dict[str, tuple[int, list[int]]]) -> bool:
    """Print the figures by package, and the worst files; whether all is as wanted."""
    packages, tops = defaultdict(lambda: [0, 0]), {top: [0, 0] for top in WANTED}
    for name, (statements, missing) in found.items():
        top = next(top for top in WANTED if name.startswith(top + "/"))
        for sums in (packages[str(Path(name).parent)], tops[top]):
            sums[0] += statements
            sums[1] += len(missing)
    for name, sums in packages.items():
        print(f"{name:36} {_percent(*sums)}")
    print("\nmost lines not run:")
    for name, (_, missing) in sorted(found.items(), key=lambda item: -len(item[1][1]))[:WORST]:
        print(f"{name:44} {len(missing):3}: {' '.join(map(str, missing))[:120]}")
    print()
    for top, sums in tops.items():
        print(f"{top:36} {_percent(*sums)}  (at least {100 * WANTED[top]:.0f} %)")
    return all(sums[1] <= (1.0 - WANTED[top]) * sums[0] for top, sums in tops.items())


def _percent(statements: int, missing: int) -> str:
    share = 100.0 * (1.0 - missing / statements) if statements else 100.0
    return f"{share:6.2f} % of {statements:5} lines"


def main() -> int:
    """0 where the lines are as wanted."""
    parser = argparse.ArgumentParser(prog="lines", description=__doc__)
    parser.add_argument("tests", nargs="*", help="some tests only: their lines")
    words = parser.parse_args()
    with TemporaryDirectory(prefix="lines-") as folder:
        found = counted(measured(Path(folder).resolve(), words.tests))
    return 0 if tell(found) else 1


if __name__ == "__main__":
    sys.exit(main())
