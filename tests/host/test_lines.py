"""The measuring of lines and of mutants (`make lines`, `make mutation`) itself."""

import subprocess
from pathlib import Path

import pytest
from barberpole.twin.interpreter import find_micropython
from coverage.parser import PythonParser
from lines.marked import Markers
from mutation.mutants import compiles, mutants

REPOSITORY = Path(__file__).parents[2]
SOURCE = """\
import micropython


@micropython.viper
def total(count: int) -> int:
    found = 0
    while count:
        found += count
        count -= 1
    return found


def kind(value):
    try:
        if value > 10:
            return "large"
        elif value == 3:
            return "three"
        else:
            value += "x"
    except TypeError:
        pass
    finally:
        value = None
    return "other"


print(total(4), kind(3), kind(4))
"""
LOCKED = "import micropython, _lines\nmicropython.heap_lock()\n_lines.passed(0)\nmicropython.heap_unlock()\n"
FAULTY = """\
'2 + 2'
N: "a < b" = 3
def f(a, b):
    if a < b and not b:
        return max(a, -2.0 * b[1:N])
    a += 1
"""
NOT_RUN = {SOURCE[: SOURCE.index('return "large"')].count("\n") + 1}


def test_markers_tell_the_lines_that_micropython_ran(tmp_path):
    markers, record = Markers(), tmp_path / "passed"
    (tmp_path / "made.py").write_text(markers.marked("made.py", SOURCE))
    (tmp_path / "_lines.py").write_text(markers.recorder(str(record)))
    script = (
        "import micropython, _lines\nmicropython.heap_lock()\n_lines.passed(0)\nmicropython.heap_unlock()\nimport made"
    )
    words = [find_micropython(), "-c", script]
    done = subprocess.run(words, env={"MICROPYPATH": str(tmp_path)}, capture_output=True, text=True, check=True)
    assert done.stdout == "10 three other\n"
    parser = PythonParser(text=SOURCE)
    parser.parse_source()
    assert parser.statements - markers.lines(record.read_bytes())["made.py"] == NOT_RUN


@pytest.mark.parametrize("path", sorted((REPOSITORY / "firmware").rglob("*.py")), ids=lambda path: path.stem)
def test_every_statement_of_the_firmware_can_be_marked(path):
    markers, text = Markers(), path.read_text()
    marked = markers.marked(path.name, text)
    compile(marked, path.name, "exec")
    parser = PythonParser(text=text)
    parser.parse_source()
    lines = {line for _, lines in markers.places for line in lines}
    assert parser.statements <= {parser.first_line(line) for line in lines} | lines


def test_mutants_are_small_faults_of_what_computes():
    made = mutants("f.py", FAULTY)
    assert all(compiles(m) for m in made)
    assert {(m.kind, m.after) for m in made} >= {
        ("constant", 'N: "a < b" = 4'),
        ("comparison", "if (a <= b) and not b:"),
        ("boolean", "if (a < b or not b):"),
        ("sign", "if a < b and (b):"),
        ("condition", "if (not (a < b and (not b))):"),
        ("name", "return min(a, -2.0 * b[1:N])"),
        ("sign", "return max(a, (2.0) * b[1:N])"),
        ("constant", "return max(a, -4.0 * b[1:N])"),
        ("arithmetic", "return max(a, (-2.0 / b[1:N]))"),
        ("slice", "return max(a, -2.0 * b[:N])"),
        ("return", "return (None)"),
        ("arithmetic", "a -= 1"),
    }
    assert not [m for m in made if m.line == 1]
    assert len({m.key for m in made}) == len(made)
