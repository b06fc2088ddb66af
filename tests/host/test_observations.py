"""What a fit sees: SET and RESET in turns, with one sign, whichever way the log carried them."""

import numpy as np
import pytest
from barberpole.board import load_sensor
from barberpole.log import Log
from barberpole.observations import observations

RNG = np.random.default_rng(7)
GAIN, OFFSET = 100.0, 1500.0  # LSB/µT and LSB: a bridge offset of 15 µT


def tumble(n: int) -> np.ndarray:
    """Field (3, n) in µT that turns slowly enough for neighbours to be alike."""
    turn = np.linspace(0, 12, n)
    return 50.0 * np.stack([np.cos(turn), np.sin(turn) * np.cos(0.3 * turn), np.sin(turn) * np.sin(0.3 * turn)])


def still(n: int) -> np.ndarray:
    return np.repeat([[20.0], [-30.0], [35.0]], n, axis=1)


def reading(field: np.ndarray, state: np.ndarray | float, raw: bool) -> np.ndarray:
    """Raw: s G f + o. Turned: G f + s o."""
    value = state * GAIN * field + OFFSET + RNG.normal(0, 1, field.shape)
    return value if raw else state * value


def log(**columns) -> Log:
    return Log({name: np.asarray(values, float) for name, values in columns.items()}, None, "")  # type: ignore[arg-type]


def axes(name: str, values: np.ndarray) -> dict[str, np.ndarray]:
    return {name.format(axis): values[i] for i, axis in enumerate("xyz")}


@pytest.mark.parametrize("raw", [True, False])
@pytest.mark.parametrize("field", [tumble(200), still(200), still(1)])
def test_pairs(raw, field):
    columns = {
        **axes("{}_set_lsb", reading(field, 1.0, raw)),
        **axes("{}_reset_lsb", reading(field, -1.0, raw)),
        **axes("b{}_ut", field),
        "temp_c": np.arange(field.shape[1]),
    }
    seen = observations(log(**columns))
    n = field.shape[1]
    assert (seen.reference, seen.raw_polarity, seen.at.raw_polarity) == ("vector", raw, raw)
    assert seen.y.shape == (3, 2 * n)
    np.testing.assert_array_equal(seen.at.state, np.tile([1.0, -1.0], n))
    np.testing.assert_array_equal(seen.row, np.repeat(np.arange(n), 2))
    np.testing.assert_array_equal(seen.at.temp_c, seen.row)
    assert seen.b_ut is not None
    expected = GAIN * seen.b_ut + seen.at.state * OFFSET
    np.testing.assert_allclose(seen.y, expected, atol=6)
    assert bool(seen.notes) == raw


def test_polarity_of_a_board_record_is_known():
    # at rest, with an offset larger than the field, the data alone would mislead
    field = 0.1 * still(50)
    columns = {**axes("{}_set_lsb", reading(field, 1.0, True)), **axes("{}_reset_lsb", reading(field, -1.0, True))}
    board = Log(columns, None, "", meta={"polarity": "raw"})  # type: ignore[arg-type]
    assert observations(board).raw_polarity


@pytest.mark.parametrize("raw", [True, False])
@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("block", [1, 25])
def test_single_readings_with_a_state(raw, known, block):
    field = tumble(400)
    state = np.where(np.arange(400) // block % 2 == 0, 1.0, -1.0)
    columns = {**axes("{}_lsb", reading(field, state, raw)), "state": state}
    if known:
        columns |= axes("b{}_ut", field)
    seen = observations(log(**columns))
    assert seen.raw_polarity == raw
    assert seen.reference == ("vector" if known else "constant")
    np.testing.assert_allclose(seen.y, GAIN * field + state * OFFSET, atol=6)


@pytest.mark.parametrize("state", [None, 0.0, 1.0])
def test_one_state_is_left_alone(state):
    field = tumble(30)
    columns = axes("{}_lsb", GAIN * field)
    if state is not None:
        columns["state"] = np.full(30, state)
    seen = observations(log(**columns, b_ut=np.full(30, 50.0)))
    np.testing.assert_array_equal(seen.y, GAIN * field)
    np.testing.assert_array_equal(seen.at.state, np.full(30, state or 0.0))
    assert (seen.reference, seen.raw_polarity, seen.b_ut) == ("magnitude", False, None)
    np.testing.assert_array_equal(seen.b_mag, 50.0)


def test_conditions_come_along():
    field = tumble(10)
    columns = {**axes("{}_lsb", field), **axes("i{}_ma", 2 * field), "load_a": field[0], "supply_v": field[1]}
    seen = observations(log(**columns), load_sensor("hmc1001_1002"))
    np.testing.assert_array_equal(seen.at.i_ma, 2 * field)
    np.testing.assert_array_equal(seen.at.load_a, field[0])
    assert seen.at.t_s is None
    assert seen.at.easy_axis == (1, 0, 1)
