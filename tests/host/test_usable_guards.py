"""The guards of a fit at their limits: just inside is taken, just outside is refused with the reason."""

from types import SimpleNamespace

import numpy as np
import pytest
from barberpole.errors import InputError
from barberpole.fit.usable import (
    _require_a_shell,
    _require_own_axes,
    best_step,
    require_in_range,
    require_microtesla,
    require_one_field,
)
from scipy.stats import norm

N = 3000


def linear(*gains, turned=None):
    return SimpleNamespace(matrix=np.diag(gains) if turned is None else np.array(turned))


def test_an_axis_is_dead_below_a_fiftieth_of_the_others():
    _require_own_axes(linear(3.0, 3.3, 0.021 * 3.0))
    with pytest.raises(InputError, match=r"z_lsb with 0\.057 LSB/µT, the others with 3"):
        _require_own_axes(linear(3.0, 3.3, 0.019 * 3.0))


def test_an_axis_follows_its_own_component():
    def of(own):
        across = np.sqrt(1.0 - own**2)
        return linear(turned=[[3 * own, 3 * across, 0.0], [-3 * across, 3 * own, 0.0], [0.0, 0.0, 3.0]])

    _require_own_axes(of(0.21))
    with pytest.raises(InputError, match="x_lsb that follows by_ut and not bx_ut"):
        _require_own_axes(of(0.19))


def test_a_shell_is_thin_and_not_drawn_out():
    seen = SimpleNamespace(y=np.random.default_rng(1).normal(size=(3, N)))
    spread = norm.ppf((np.arange(N) + 0.5) / N)
    _require_a_shell(seen, linear(3.0, 23.7, 3.0), 1.0 + 0.19 * spread)
    for gains, width in (((3.0, 3.0, 3.0), 0.21), ((3.0, 24.3, 3.0), 0.01)):
        with pytest.raises(InputError):
            _require_a_shell(seen, linear(*gains), 1.0 + width * spread)


@pytest.mark.parametrize(
    ("largest", "unit"),
    [(0.0, ""), (0.48, "gauss"), (0.99, "gauss"), (1.0, ""), (5000.0, ""), (5001.0, "nT"), (48_000.0, "nT")],
)
def test_a_field_in_another_unit_is_refused_by_its_name(largest, unit):
    try:
        require_microtesla(largest)
        said = ""
    except InputError as error:
        said = str(error)
    assert bool(said) == bool(unit)
    assert f"is it in {unit}" in said or not unit


def test_readings_that_pile_up_at_an_end_are_refused_while_the_others_move():
    y = np.round(np.random.default_rng(2).normal(size=(3, N)) * 1000.0)
    require_in_range(y)
    for rows, refused in ((8, False), (9, True)):  # 0.3 % of 3000
        for sign in (1.0, -1.0):
            cut = y.copy()
            cut[1, 50 : 50 + rows] = sign * 6000.0
            if refused:
                with pytest.raises(InputError, match=rf"{rows} rows of y at {sign * 6000:g} LSB"):
                    require_in_range(cut)
            else:
                require_in_range(cut)
    still = y.copy()
    still[:, 50:90] = [[10.0], [6000.0], [20.0]]  # held still there: the others stand too
    require_in_range(still)


def test_the_best_step_is_that_of_trying_all():
    rng = np.random.default_rng(3)
    for _ in range(20):
        n = int(rng.integers(30, 200))
        values = rng.normal(size=n) + 2.0 * (np.arange(n) > rng.integers(10, n - 10))
        total = np.sum((values - values.mean()) ** 2)
        places = [k for k in range(1, n) if 0.1 * n <= k <= 0.9 * n]
        left = [
            np.sum((values[:k] - values[:k].mean()) ** 2) + np.sum((values[k:] - values[k:].mean()) ** 2)
            for k in places
        ]
        k = places[int(np.argmin(left))]
        at, gained, levels = best_step(values)
        assert (at, gained) == (k, pytest.approx(1.0 - min(left) / total))
        assert levels == (pytest.approx(values[:k].mean()), pytest.approx(values[k:].mean()))
    assert best_step(np.ones(9)) == (0, 0.0, (1.0, 1.0))


def stepped(size, width):
    """|B| over the known one that goes from 1 to 1 + size at two fifths of the log, within `width` of its length."""
    noise = 0.005 * np.random.default_rng(4).normal(size=N)
    return 1.0 + size * np.clip((np.arange(N) / N - 0.4) / width + 0.5, 0.0, 1.0) + noise


def test_two_fields_in_one_log_are_refused_where_the_second_begins():
    row = np.arange(N) + 10
    with pytest.raises(InputError, match=r"12 % more from row 12(09|10|11|12) on"):
        require_one_field(stepped(0.12, 1e-6), [], row)
    with pytest.raises(InputError, match="11 % less from row"):
        require_one_field(1.0 / stepped(0.12, 1e-6), [], row)
    require_one_field(stepped(0.09, 1e-6), [], row)  # too small a step
    require_one_field(stepped(0.4, 0.3), [], row)  # it came slowly: a drift
    with pytest.raises(InputError):
        require_one_field(stepped(0.12, 0.02), [], row)


def test_a_step_with_a_cause_is_none_of_the_field():
    row, rng = np.arange(N), np.random.default_rng(5)
    ratio, cause = stepped(0.12, 1e-6), rng.normal(size=N)
    with pytest.raises(InputError):
        require_one_field(ratio, [cause], row)
    with pytest.raises(InputError):
        require_one_field(ratio, [cause + 1.8 * (np.arange(N) >= 0.4 * N)], row)
    require_one_field(ratio, [cause, cause + 2.3 * (np.arange(N) >= 0.4 * N)], row)
