"""The firmware's own checks, run by MicroPython on fake pins, buses and chips (tests/firmware/on_board)."""

from pathlib import Path

import pytest

CHECKS = sorted((Path(__file__).parent / "on_board").glob("check_*.py"))


@pytest.mark.parametrize("script", CHECKS, ids=lambda path: path.stem)
def test_on_board(script, micropython, tmp_path):
    done = micropython(script, cwd=tmp_path).splitlines()
    wanted = [line.split("(")[0][4:] for line in script.read_text().splitlines() if line.startswith("def check_")]
    assert [line.split()[1] for line in done if line.startswith("ok")] == sorted(wanted)
