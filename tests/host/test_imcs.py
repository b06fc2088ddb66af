"""The coil driver's file, its tables, a hand-turned log played again, and two clocks that part."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from barberpole import paths
from barberpole.board import load_board
from barberpole.challenge.motion import directions
from barberpole.cli import run as command
from barberpole.commands.imcs import turned
from barberpole.design.coil import CoilPair, axis_field_ut
from barberpole.driver_board import is_driver, load_driver
from barberpole.errors import BarberpoleError, InputError, LimitError
from barberpole.imcs import Driven, join
from barberpole.log import Log, write_log
from barberpole.trajectory import driver_table, for_driver, sphere

TEXT = (paths.boards() / "drivers" / "imcs_driver.toml").read_text()
K = np.array([0.54, 0.52, 0.55])


@pytest.fixture
def driver():
    return load_driver("imcs_driver")


def test_the_coil_constant_is_that_of_the_thesis_coil(driver):
    """Eq. 6.2 with 60 turns and the radius of 10 cm that the printed figures go with."""
    assert driver.coils.ut_per_ma[0] == pytest.approx(float(axis_field_ut(CoilPair(100.0, 60.0), 1.0, 0.0)), rel=1e-4)


def test_the_table_makes_the_field_that_was_asked_for(driver):
    table, wanted = driver_table(for_driver(driver), driver), for_driver(driver).field_ut
    made = table.current_ma * np.array(driver.coils.ut_per_ma)
    assert np.max(np.abs(made - wanted)) < 0.5 * 54.0 / 32768 + 1e-9  # half a code
    with pytest.raises(LimitError, match=r"coils\.max_ma"):
        driver_table(sphere((60.0,), 12), driver)


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ('role = "coil_driver"', 'role = "sensor"', "board.role"),
        ("amplifier_gain = 6.0", "amplifier_gain = 5.0", "full_scale_ma of x"),
        ("coil_shunt_ohm = 10.0 ", "coil_shunt_ohm = 13.0 ", "full_scale_ma"),
        ("max_ma = 95.0", "max_ma = 120.0", "coils.max_ma"),
        ("settle_ms = 5.0", "settle_ms = 49.9", "hold_ms"),
        ("coil_y = 1", "coil_y = 0", "three different ones"),
        ('drdy_pin = "X4"', 'drdy_pin = "X5"', "four different"),
        ("hold_ms", "hold_s", "hold_ms"),
        ("[drive]", "[driver]", "drive"),
    ],
)
def test_what_cannot_work_is_refused(tmp_path, old, new, reason):
    path = tmp_path / "driver.toml"
    path.write_text(TEXT.replace(old, new))
    with pytest.raises(BarberpoleError, match=reason):
        load_driver(path)


def test_each_role_is_told_from_the_other(tmp_path):
    assert is_driver("imcs_driver")
    assert not is_driver("pybv11")
    shutil.copy(paths.boards() / "drivers" / "imcs_driver.toml", tmp_path / "one.toml")
    assert is_driver(tmp_path / "one.toml")
    with pytest.raises(InputError, match="sensor board"):
        load_board(tmp_path / "one.toml")


def made(path, y, t_s, **columns):
    names = dict(zip(("x_lsb", "y_lsb", "z_lsb"), y, strict=True))
    return Log({"t_s": t_s, **names, **columns}, Path(path), "0" * 64)


def both(seconds, shift_s, drift, pitch_s=0.05, rows_hz=200.0):
    """A driver that turns the field every 264 points, and a sensor whose clock differs."""
    rng = np.random.default_rng(1)
    from_s = 0.005 + pitch_s * np.arange(int(seconds / pitch_s))
    turn = sphere((30.0, 48.0), 264).field_ut.T
    current = turn[:, np.arange(from_s.size) % 264] / K[:, None]
    driven = Driven(from_s, from_s + pitch_s - 0.005, current, K, Path("driver.bpr"))
    t = np.arange(0.0, seconds - 2.0, 1.0 / rows_hz)
    seen = t + shift_s + drift * (t - 0.5 * (t[0] + t[-1]))
    hold = np.clip(np.searchsorted(driven.to_s, seen), 0, from_s.size - 1)
    field = np.where((seen > 0.0) & (seen < driven.to_s[-1]), K[:, None] * current[:, hold], 0.0)
    y = 20.0 * field + np.array([[30.0], [-10.0], [5.0]]) + 0.2 * rng.normal(size=field.shape)
    return made("sensor.csv", y, t), driven, field


@pytest.mark.parametrize(
    ("seconds", "shift_s", "drift"), [(12.0, 0.731, 0.0), (12.0, -3.2, 5e-5), (150.0, 1.4, 1.5e-4)]
)
def test_two_clocks_are_brought_together(seconds, shift_s, drift):
    sensor, driven, field = both(seconds, shift_s, drift)
    found = join(sensor, driven)
    turns_s = 264 * 0.05
    apart = (found.clocks.shift_s - shift_s + 0.5 * turns_s) % turns_s - 0.5 * turns_s  # whole turns look the same
    assert abs(apart) < 3e-3
    if seconds > 100.0:
        assert found.clocks.drift == pytest.approx(drift, abs=3e-5)
    rows = np.isin(sensor["t_s"], found.log["t_s"])
    assert np.allclose(np.stack([found.log[n] for n in ("bx_ut", "by_ut", "bz_ut")]), field[:, rows], atol=1e-9)
    assert rows.sum() > 0.4 * rows.size


def test_a_sensor_that_was_elsewhere_is_refused():
    sensor, driven, _ = both(12.0, 0.0, 0.0)
    noise = np.random.default_rng(2).normal(size=(3, sensor.n))
    with pytest.raises(InputError, match="follow the driver's currents"):
        join(made("elsewhere.csv", noise, sensor["t_s"]), driven)


def test_constants_with_angles_between_the_coils():
    sensor, driven, _ = both(12.0, 0.2, 0.0)
    bent = np.diag(K) + 0.01 * np.array([[0, 1, 0], [0, 0, 1], [0, 0, 0]])
    straight, crooked = join(sensor, driven).log, join(sensor, driven, bent).log
    assert not np.allclose(straight["bx_ut"], crooked["bx_ut"])
    assert np.allclose(straight["bz_ut"], crooked["bz_ut"])


def test_a_hand_turned_log_is_played_again(tmp_path, capsys):
    """Fig. 6.15: the readings of a turned sensor become the currents of the coils."""
    rng = np.random.default_rng(3)
    field = 48.0 * directions(2000, rng)
    log = made(
        tmp_path / "turned.csv", 20.0 * field + 100.0 + 0.1 * rng.normal(size=field.shape), np.arange(2000) / 50.0
    )
    write_log(log, log.path)
    played = turned(log.path, load_driver("imcs_driver")).field_ut.T
    assert np.linalg.norm(played, axis=0) == pytest.approx(np.full(264, 50.0), rel=1e-3)  # 50 µT unless the log says
    rows = np.round(np.linspace(0, 1999, 264)).astype(int)
    assert np.max(np.abs(played / 50.0 - field[:, rows] / 48.0)) < 5e-3
    args = ["build", "imcs_driver", "--replay", str(log.path), "-o", str(tmp_path / "build"), "--json"]
    assert command(args) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["role"] == "coil_driver"
    assert f'ID = "{said["trajectory"]}"' in (tmp_path / "build" / "src" / "bp_trajectory.py").read_text()
