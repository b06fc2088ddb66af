"""Programs of field and temperature, and what a world may hide."""

import math

import numpy as np
import pytest
from barberpole.errors import InputError
from barberpole.twin import HIDDEN, Constant, Cycle, Fixed, Plateaus, Stations, Stepped, Tumble, World


def test_stations_hold_and_step():
    world = World(ambient=Stations(((1.0, 10.0, 0.0, 0.0), (0.5, 0.0, 20.0, 0.0), (0.5, 0.0, 0.0, 30.0))))
    field = world.field([0.0, 0.999, 1.0, 1.499, 1.5, 99.0])
    assert field.shape == (3, 6)
    assert np.abs(field).max(axis=0).tolist() == [10.0, 10.0, 20.0, 20.0, 30.0, 30.0]
    assert world.constant_until(0.2) == 1.0
    assert world.constant_until(1.0) == 1.5
    assert world.constant_until(5.0) == math.inf
    assert world.steady([0.5, 0.99, 1.03, 1.49], margin_s=0.02).tolist() == [True, False, True, False]


def test_stations_cover_the_sphere_with_every_magnitude():
    stations = Stations.on_sphere(90, (30.0, 50.0, 70.0), hold_s=0.5, first_s=2.0)
    vectors = np.array(stations.holds)[:, 1:]
    sizes = np.linalg.norm(vectors, axis=1)
    assert np.unique(sizes.round(9)).tolist() == [30.0, 50.0, 70.0]
    spread = (vectors / sizes[:, None]).T @ (vectors / sizes[:, None]) / 90
    assert np.allclose(spread, np.eye(3) / 3.0, atol=0.02)
    assert stations.steps_s()[:2] == (2.5, 3.0)


def test_tumble_keeps_its_magnitude_and_reaches_every_direction():
    field = World(ambient=Tumble(48.0)).field(np.linspace(0.0, 60.0, 5000))
    assert np.allclose(np.linalg.norm(field, axis=0), 48.0)
    assert (field.max(axis=1) > 45.0).all()
    assert (field.min(axis=1) < -45.0).all()


def test_stepped_field_is_the_base_before_and_more_after():
    ambient = Stepped(Fixed((1.0, 2.0, 3.0)), at_s=0.4, jump_ut=(1.0, 0.0, 0.0))
    assert World(ambient=ambient).field([0.39, 0.4])[0].tolist() == [1.0, 2.0]
    assert ambient.constant_until(0.1) == 0.4
    assert ambient.constant_until(0.4) == math.inf


def test_temperature_cycles_up_and_down_between_its_ends():
    world = World(temperature=Cycle(10.0, 50.0, period_s=8.0, rest_s=1.0))
    t_s = np.linspace(0.0, 17.0, 1701)
    temp = world.temp(t_s)
    assert temp.min() == pytest.approx(10.0)
    assert temp.max() == pytest.approx(50.0)
    assert temp[0] == pytest.approx(30.0)
    assert np.abs(np.diff(temp)).max() < 0.11  # 80 K in 8 s, in steps of 10 ms: no jumps
    assert world.constant_until(0.3) == 1.0
    assert world.constant_until(2.0) == 2.0
    assert World(temperature=Constant(7.0)).temp(3.0).tolist() == [7.0]


def test_temperature_rests_on_plateaus():
    world = World(temperature=Plateaus((25.0, 40.0, 10.0), hold_s=2.0, rest_s=1.0))
    assert world.temp([0.0, 2.9, 3.1, 4.9, 5.1, 60.0]).tolist() == [25.0, 25.0, 40.0, 40.0, 10.0, 10.0]
    assert [world.constant_until(t) for t in (0.5, 1.5, 3.0, 5.5)] == [3.0, 3.0, 5.0, math.inf]


def test_only_the_named_effects_are_there(board):
    plain = World.of(board, hidden=("none",))
    for name in HIDDEN:
        changed = World.of(board, hidden=(name,))
        assert (changed == plain) == (name == "none")
    assert World.of(board).anisotropy_ut == tuple(board.sensor.anisotropy_field_ut)
    assert World.of(board, hidden=(), noise=0.0).noise == 0.0


def test_unknown_effect_is_refused(board):
    with pytest.raises(InputError, match=r"one of none, cross_field.*'crossfield'"):
        World.of(board, hidden=("crossfield",))


def test_drift_changes_gain_and_bias_only(board):
    world = World.of(board)
    drifted = world.drifted(gain_drift=(1.01, 1.0, 0.99))
    assert drifted.gain_drift == (1.01, 1.0, 0.99)
    assert drifted.drifted(gain_drift=(1.0, 1.0, 1.0)) == world
