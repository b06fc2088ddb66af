"""The table of published figures: complete, deterministic, and each difference explained."""

from collections import Counter
from pathlib import Path

import pytest
from barberpole.board import load_board
from barberpole.reproduce.repeatability import BIAS_PPM, SCALE_PPM, expected_ppm
from barberpole.reproduce.row import Row
from barberpole.reproduce.table import _line, all_rows, markdown, write_page

ROWS = all_rows(power_ups=4)  # of the emulated board; the page takes 20


def label(row: Row) -> str:
    return f"{row.source}, {row.item}: {row.quantity}"


@pytest.mark.parametrize("row", ROWS, ids=label)
def test_published_number_is_met_or_the_difference_explained(row):
    assert row.met or row.remark, f"published {row.published}, ours {row.ours}: say why"


def test_no_row_twice():
    assert [name for name, count in Counter(map(label, ROWS)).items() if count > 1] == []


def test_ratio_and_tolerance():
    assert Row("thesis", "eq. 1", "a", 2.0, 2.03).met
    assert not Row("thesis", "eq. 1", "a", 2.0, 2.05).met
    assert Row("thesis", "eq. 1", "a", 2.0, 3.0).ratio == 1.5
    assert Row("thesis", "eq. 1", "a", 0.0, 0.0).ratio is None
    assert Row("thesis", "fig. 1", "a", None, 3.0).met


def test_page_is_the_same_twice(tmp_path):
    page = tmp_path / "reproduction.md"
    write_page(page, ROWS)
    assert page.read_text(encoding="utf-8") == markdown(ROWS)


def test_the_emulated_board_repeats_as_its_noise_allows():
    ranges = [row.ours for row in ROWS if row.item == "6.2.2.2"]
    assert 0.3 * expected_ppm(load_board("pybv11"), 4) < ranges[0] < SCALE_PPM
    assert ranges[1] < 2.0 * BIAS_PPM


def test_what_the_page_in_the_docs_lists():
    """It was made by the code as it is: the same rows, and every closed form to the last digit."""
    page = (Path(__file__).parents[2] / "host" / "docs" / "reproduction.md").read_text(encoding="utf-8")
    stale = [label(row) for row in ROWS if "emulated" not in row.quantity and _line(row) not in page]
    assert stale == [], "run make reproduce"


def test_page_has_a_line_for_each_row():
    rows = [Row("thesis", "table 9.9", "a field", 46.4, 46.0, "µT", "why"), Row("article", "fig. 9", "b", None, 1e-7)]
    text = markdown(rows)
    assert "| table 9.9 | a field | µT | 46.4 | 46 | 0.991 | why |" in text
    assert "## The thesis" in text
    assert "| fig. 9 | b |  |  | 1e-07 |  |  |" in text
    assert "2 rows; of 1 printed numbers 1 are met within 2 %, 0 are not." in text
