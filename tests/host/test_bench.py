"""The bench itself, and its bounds, loosely: the machine that tests may be busy. `make bench` holds them strictly."""

import time

import numpy as np
import pytest
from barberpole.fit.fit import fit_observations
from bench import __main__ as bench
from bench.cases import LINEAR, Case, cases, decoding, plain
from bench.data import turned


def processor_s(work) -> float:
    began = time.process_time()
    work()
    return time.process_time() - began


@pytest.mark.parametrize(
    ("n", "reference", "times"),
    [(10_000, "vector", 3.0), (10_000, "constant", 6.0), (100_000, "vector", 2.0), (100_000, "constant", 4.0)],
)
def test_a_linear_fit_costs_a_few_plain_fits(n, reference, times):
    seen, beside = turned(n, reference), plain(n)
    ratios = [processor_s(lambda: fit_observations(seen, LINEAR)) / processor_s(beside) for _ in range(9)]
    assert np.median(ratios) < times


def test_the_ladder_fits_to_the_noise():
    case = cases()["ladder"]()
    assert case.error(case.run()) < 0.02


def test_records_are_read_fast_and_whole():
    case = decoding(16_000)
    assert case.error(case.run()) == 0.0
    assert min(processor_s(case.run) for _ in range(3)) < 3.0 * (case.seconds or 0.0)


def test_a_case_over_its_limit_is_marked(monkeypatch):
    monkeypatch.setattr(bench, "LONGEST_S", 0.0)
    slow = Case("slow", 1000, lambda: sum(range(3_000_000)), lambda _: 0.5, "error", seconds=0.001)
    fine = Case("fine", 1000, lambda: None, lambda _: 0.5, "error", most=0.6)
    assert [bench.measured(case)["over"] for case in (slow, fine)] == [True, False]


def test_a_regression_shows_in_the_table(capsys):
    one = {"what": "fit", "n": 10, "seconds": 1.0, "ratio": 2.0, "error": 1.0, "meaning": "", "peak_mb": 1.0}
    one |= {"over": False, "limits": {"ratio": 4.0, "seconds": None}}
    bench.show({"fit": one}, {"fit": one | {"ratio": 1.0}})
    assert "SLOWER" in capsys.readouterr().out
