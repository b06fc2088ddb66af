"""Damaged files of every kind through the command line: a small sample of what `make fuzz` tries ten thousand times."""

import pytest
from fuzzing.case import case
from fuzzing.child import start
from fuzzing.run import bench, search, told

CASES = 60


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return bench(tmp_path_factory.mktemp("fuzz"))


def test_damaged_files_end_in_a_sentence(made):
    search(made, (case(made.kinds, 7, number) for number in range(CASES)))
    assert [outcome.fault for outcome in made.faults] == []
    assert made.exits[0] + made.exits[1] > CASES // 10
    assert made.exits[2] > CASES // 3


def test_a_case_is_the_same_by_seed_and_number(made):
    first, again, other = (case(made.kinds, seed, 31) for seed in (5, 5, 6))
    assert (first.content, first.command) == (again.content, again.command)
    assert first.content != other.content


FAULTS = {
    "raise ValueError": "ValueError",
    "import time; time.sleep(100)": "did not end",
    "while True: pass": "processor time",
    "x = bytearray(400 << 20)": "MB of memory",
    "import os; os.kill(os.getpid(), 9)": "SIGKILL",
    "import os; os.write(2, b'DLASCL')": "a library spoke",
}


@pytest.mark.parametrize("does", FAULTS)
def test_every_kind_of_fault_is_seen(made, tmp_path, monkeypatch, does):
    """Traceback, hang, too much time or memory, a crash and what a library writes past Python."""
    monkeypatch.setattr("fuzzing.child.HANGING_S", 3.0 if "sleep" in does else 60.0)
    monkeypatch.setattr("fuzzing.child.SLOW_S", 1.0)
    monkeypatch.setattr("fuzzing.child.run", lambda words: exec(does) or 0)
    one = case(made.kinds, 1, 1)
    child = start(one, tmp_path / "case", made.good)
    while not child.overdue and not child.ready(0.2):
        pass
    outcome = child.end()
    assert FAULTS[does] in outcome.fault
    said = told(outcome, tmp_path / "kept")
    assert "--seed 1 --only 1" in said
    assert (tmp_path / "kept" / one.name).read_bytes() == one.content
