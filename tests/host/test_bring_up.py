"""host/docs/bring-up.md against the board files."""

from dataclasses import replace
from pathlib import Path

import pytest
from barberpole.board import load_board
from barberpole.bring_up import BOARDS, SUPPLY_FRACTION, bring_up, steps
from barberpole_codegen import settings

PAGE = Path(__file__).parents[2] / "host" / "docs" / "bring-up.md"


def test_page_is_up_to_date():
    assert PAGE.read_text() == bring_up(), "run `make docs`"
    assert SUPPLY_FRACTION == settings.SUPPLY_FRACTION


@pytest.mark.parametrize("name", BOARDS)
def test_every_step_names_signal_pin_and_figure(name):
    found = steps(load_board(name))
    assert len(found) >= 12
    assert all(step.signal and step.pin and step.expected and step.how for step in found)
    order = [step.signal for step in found]
    assert order.index("pulse inputs of the strap driver") < order.index("SET pulse") < order.index("strap supply")
    assert order.index("strap supply") < order.index("SET and RESET readings") < order.index("self-calibration")


def test_figures_follow_the_board_file():
    board = load_board("pybv11_timed")
    slower = replace(board, flip=replace(board.flip, rate_hz=500.0, pulse_us=10.0))
    said = {step.signal: step for step in steps(slower)}
    assert said["SET pulse"].pin == "Y1 (PC6)"
    assert said["SET pulse"].expected == "3.3 V, 10 µs ± 0.08 µs, 500 a second"
    assert said["RESET pulse"].expected.startswith("as SET, 1000 µs ± 0.08 µs after it")
    assert "0.54 A peak" in {step.signal: step for step in steps(board)}["strap current"].expected
    assert said["kill loop"].pin == "X7 (PA6)"
