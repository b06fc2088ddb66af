"""The article's three sensors as files: they load, simulate, and give their own table 1 back when characterised."""

import json

import numpy as np
import pytest
from barberpole.board import load_board, load_sensor
from barberpole.characterise.sheet import make_sheet
from barberpole.characterise.simulate import noise, readings, sensitivity_nt, white_and_corner
from barberpole.cli import run as command
from barberpole.errors import InputError
from barberpole.log import read_log
from barberpole.paths import boards

KINDS = ("hmc5983", "lsm303dlhc", "lis3mdl")


@pytest.mark.parametrize("name", KINDS)
def test_the_noise_of_the_bridge_is_that_of_table_1(name):
    sensor = load_sensor(name)
    made = white_and_corner(
        sensor.digital.noise_nt[0], sensor.digital.noise_at_1_hz_nt_per_rthz[0], sensor.digital.rate_hz
    )
    assert sensor.noise_nt_per_rthz == pytest.approx(made[0], rel=0.01)
    assert sensor.corner_hz == pytest.approx(made[1], rel=0.05, abs=0.05)
    y = noise(sensor.digital, round(300 * sensor.digital.rate_hz), np.random.default_rng(1))
    assert np.allclose(y.std(axis=1), sensor.digital.noise_nt, rtol=0.2)  # the slowest 1/f swings vary


@pytest.mark.parametrize("name", KINDS)
def test_tempco_is_the_drift_formula(name):
    sensor = load_sensor(name)
    step = (sensitivity_nt(sensor.digital, 25.5) - sensitivity_nt(sensor.digital, 24.5))[0]
    assert sensor.sensitivity_tempco_per_c == pytest.approx(-step / sensor.digital.sensitivity_nt_per_lsb[0], rel=1e-3)


@pytest.mark.parametrize("name", KINDS)
def test_simulated_and_characterised(name, tmp_path, capsys):
    paths = [tmp_path / f"{program}.csv" for program in ("linearity", "rest", "sine")]
    for path in paths:
        assert command(["simulate", name, "--program", path.stem, "-o", str(path)]) == 0
    sheet = make_sheet([read_log(path) for path in paths])
    got, digital = {(f.quantity, f.case): f for f in sheet.figures}, load_sensor(name).digital
    for i, axis in enumerate("xyz"):
        one = got["linear sensitivity", axis]
        assert one.value == pytest.approx(digital.sensitivity_nt_per_lsb[i], rel=0.03)
        assert got["noise standard deviation", axis].value == pytest.approx(digital.noise_nt[i], rel=0.25)
    assert abs(got["misalignment angle", "x-y"].value) == pytest.approx(digital.misalignment_deg[0], abs=0.5)
    assert "1 Hz" in {case for _, case in got}


def test_a_board_with_such_a_sensor_loads(tmp_path):
    text = (boards() / "pybv11.toml").read_text().replace('"hmc1021_1022"', '"hmc5983"')
    path = tmp_path / "digital.toml"
    path.write_text(text)
    assert load_board(path).sensor.digital is not None


def test_refusals(tmp_path, capsys):
    with pytest.raises(InputError, match=r"\[sensor.digital\]"):
        readings(load_sensor("hmc1021_1022"), np.zeros((3, 10)))
    with pytest.raises(InputError, match="within ±88"):
        readings(load_sensor("hmc5983"), np.full((3, 10), 100.0))
    assert command(["simulate", "hmc5983", "--program", "dance", "-o", str(tmp_path / "a.csv")]) == 2


def test_a_turned_sensor_is_calibrated_by_the_ellipsoid(tmp_path, capsys):
    path = tmp_path / "turned.csv"
    assert command(["simulate", "hmc5983", "--program", "turned", "-o", str(path)]) == 0
    capsys.readouterr()
    assert command(["fit", str(path), "--method", "ellipsoid", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rms_norm_percent"] < 0.3  # the noise is 60 nT of 48 µT
