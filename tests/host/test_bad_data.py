"""The failure matrix: bad data end right or refused, never finite, confident and wrong; and the page says so."""

from pathlib import Path

import numpy as np
import pytest
from barberpole.limits import sensor
from barberpole.limits.judge import judge, table, truth, ways
from barberpole.limits.page import outcome_table
from barberpole.limits.spoil import CASES

PAGE = Path(__file__).parents[2] / "host" / "docs" / "limits.md"
GOOD = CASES[0]


@pytest.fixture(scope="module")
def found():
    return table()


def test_nothing_is_finite_confident_and_wrong(found):
    wrong = {(case, way): o.why for case, row in found.items() for way, o in row.items() if o.said == "wrong"}
    assert wrong == {}


def test_good_data_are_answered(found):
    for case in ("good data", "one NaN", "gaps", "duplicated rows"):
        assert {o.said for o in found[case].values()} == {"right"}, case


def test_what_no_method_can_use_is_refused_by_all(found):
    for case in ("shuffled time", "saturated rows"):
        assert {o.said for o in found[case].values()} == {"refused"}, case
    assert "right" not in {o.said for way, o in found["gauss called µT"].items() if not way.startswith("diagnose")}


def test_a_refusal_says_what_to_do(found):
    sentences = {o.why for row in found.values() for o in row.values() if o.said == "refused"}
    for sentence in sentences:
        assert ("must" in sentence and "got" in sentence) or "turn" in sentence or "record" in sentence, sentence


def test_the_page_is_what_comes_out(found):
    text = PAGE.read_text()
    for line in outcome_table(found):
        assert line in text, "host/docs/limits.md is out of date: make docs"


def test_the_truth_of_the_table_is_the_sensor_of_the_table():
    """The answers to good data without noise, against the numbers that the recordings were made of."""
    by_name = {way.name: truth(GOOD, way) for way in ways()}
    gain = np.linalg.norm(sensor.GAIN, axis=1)
    for i, axis in enumerate("xyz"):
        assert by_name["fit, vector"][f"bias.{axis}"][0] == pytest.approx(sensor.OFFSET[i], abs=1e-6)
        assert by_name["fit, vector"][f"scale.{axis}"][0] == pytest.approx(gain[i], rel=1e-9)
        assert by_name["fit, constant"][f"bias.{axis}"][0] == pytest.approx(sensor.OFFSET[i], abs=1e-3)
        assert by_name["--method ellipsoid"][f"b.{axis}"][0] == pytest.approx(sensor.OFFSET[i], abs=1e-3)
        assert by_name["--method linear"][f"offset.{axis}"][0] == pytest.approx(sensor.OFFSET[i], abs=1e-6)
    upper = np.linalg.cholesky(np.linalg.inv(sensor.GAIN @ sensor.GAIN.T)).T
    assert by_name["--method ellipsoid"]["L.12"][0] == pytest.approx(upper[0, 1], abs=1e-8)


def test_other_noise_ends_the_same(monkeypatch):
    """The fit's cells again, with another draw of the noise."""
    first = sensor.Ground.log
    monkeypatch.setattr(sensor.Ground, "log", lambda self, noise=1.0, _=0: first(self, noise, 11))
    for case in CASES:
        for way in ways()[:3]:
            assert judge(case, way).said != "wrong", (case.name, way.name)
