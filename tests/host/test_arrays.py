"""A gradiometer: two sensors turned once, brought up to date in one coil run, and the gradient that they see."""

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from barberpole import paths
from barberpole.arrays.array_file import load_array, load_array_board
from barberpole.arrays.array_log import read_array_log
from barberpole.arrays.calibrate import rotation
from barberpole.cli import run as command
from barberpole.errors import BarberpoleError, InputError
from barberpole.log_formats import write_csv
from barberpole.records import encode, encode_json

TEXT = (paths.boards() / "arrays" / "gradiometer.toml").read_text()
K_UT, UT_PER_MA, NOISE_LSB = 48.0, 21.7, 0.5
GAIN, DRIFT = 100.0, {"a": np.array([1.004, 0.997, 1.002]), "b": np.array([0.996, 1.003, 0.9985])}
NONE = np.zeros(3)
GRADIENT_NT_PER_M = np.array([300.0, -150.0, 80.0])


@dataclass
class Bench:
    """y = D (P B + K i) + D b: own gains, axes and biases of each sensor; a coil acts on its own die."""

    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(3))

    def __post_init__(self):
        self.axes = {n: np.eye(3) + 0.02 * self.rng.normal(size=(3, 3)) for n in "ab"}
        self.gains = {n: GAIN * (1 + 0.02 * self.rng.normal(size=3)) for n in "ab"}
        self.bias = {n: self.rng.normal(size=3) for n in "ab"}
        self.coil = {n: UT_PER_MA * (1 + 0.02 * self.rng.normal(size=3)) for n in "ab"}
        self.drift = {n: np.ones(3) for n in "ab"}

    def read(self, name, field_ut, current_ma=0.0):
        inside = self.axes[name] @ field_ut + self.coil[name][:, None] * current_ma + self.bias[name][:, None]
        noise = NOISE_LSB * self.rng.normal(size=field_ut.shape)
        return (self.gains[name] * self.drift[name])[:, None] * inside + noise

    def log(self, path, field_a, current_ma=None, gradient=NONE):
        n = field_a.shape[1]
        field_b = field_a + 1e-3 * 0.2 * gradient[:, None]
        i = np.zeros((3, n)) if current_ma is None else current_ma
        columns = {"t_s": np.arange(n) / 50.0}
        for name, b in (("a", field_a), ("b", field_b)):
            columns |= {f"{name}_{axis}_lsb": y for axis, y in zip("xyz", self.read(name, b, i), strict=True)}
        columns |= {f"i{axis}_ma": v for axis, v in zip("xyz", i, strict=True)}
        path.write_bytes(write_csv(columns))
        return str(path)


def scattered(n, rng):
    v = rng.normal(size=(3, n))
    return v / np.linalg.norm(v, axis=0)


@pytest.fixture
def logs(tmp_path):
    bench = Bench()
    ambient = np.repeat([[18.0], [-6.0], [44.0]], 264, axis=1)
    current = 3.0 * scattered(264, bench.rng)
    out = {
        "turned": bench.log(tmp_path / "turned.csv", K_UT * scattered(3000, bench.rng)),
        "run": bench.log(tmp_path / "run.csv", ambient, current),
    }
    bench.drift = DRIFT
    out["later"] = bench.log(tmp_path / "later.csv", ambient, current)
    still = np.repeat([[18.0], [-6.0], [44.0]], 2000, axis=1)
    out["seen"] = bench.log(tmp_path / "seen.csv", still, gradient=GRADIENT_NT_PER_M)
    return out


def told(capsys, *words):
    assert command(["array", *words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_one_coil_run_brings_both_sensors_up_to_date(logs, tmp_path, capsys):
    then, now = str(tmp_path / "then.toml"), str(tmp_path / "now.toml")
    made = told(capsys, "calibrate", logs["turned"], "--run", logs["run"], "--magnitude", f"{K_UT}", "-o", then)
    assert all(made["sensors"][n]["left_ut"] < 0.01 for n in "ab")
    found = told(capsys, "selfcal", logs["later"], "--calibration", then, "-o", now)
    for name in "ab":
        assert found["sensors"][name]["gain"] == pytest.approx(DRIFT[name].tolist(), abs=2e-5)
    stale, fresh = (told(capsys, "gradient", logs["seen"], "--calibration", c)["gradients"][0] for c in (then, now))
    off = [np.max(np.abs(np.array(g["mean_nt_per_m"]) - GRADIENT_NT_PER_M)) for g in (stale, fresh)]
    assert off[0] > 500.0  # 0.4 % of 44 µT over 20 cm
    assert off[1] < 25.0  # of which the alignment by 3000 rows of 5 nT is half, bias kept from the turned log the rest
    assert fresh["baseline_m"] == pytest.approx(0.2)
    assert fresh["direction"] == [1.0, 0.0, 0.0]
    noise = np.sqrt(2.0) * NOISE_LSB / GAIN * 1000.0 / 0.2
    assert fresh["rms_change_nt_per_m"] == pytest.approx([noise] * 3, rel=0.1)


def test_the_table_of_fields_and_gradients(logs, tmp_path, capsys):
    told(capsys, "calibrate", logs["turned"], "--magnitude", f"{K_UT}", "-o", str(tmp_path / "c.toml"))
    out = tmp_path / "fields.csv"
    told(capsys, "gradient", logs["seen"], "--calibration", str(tmp_path / "c.toml"), "-o", str(out))
    assert out.read_text().splitlines()[0].replace('"', "") == (
        "t_s,a_bx_ut,a_by_ut,a_bz_ut,b_bx_ut,b_by_ut,b_bz_ut,grad_ab_x_nt_per_m,grad_ab_y_nt_per_m,grad_ab_z_nt_per_m"
    )


def test_each_sensor_is_a_log_in_the_contract(logs):
    found = read_array_log(logs["run"], load_array("gradiometer"))
    assert found["a"].has("t_s", "x_lsb", "y_lsb", "z_lsb", "ix_ma")
    assert not np.allclose(found["a"]["x_lsb"], found["b"]["x_lsb"])
    assert np.allclose(found["a"]["ix_ma"], found["b"]["ix_ma"])


def test_a_board_record_of_an_array(tmp_path):
    """The record format: the header says the role and names the columns of each sensor; rows as of any board."""
    names = [f"{s}_{axis}_lsb" for s in "ab" for axis in "xyz"]
    header = {"format": 1, "role": "array", "boot": 1, "columns": [["t_s", "q", 1e-6], *([n, "f", 1.0] for n in names)]}
    kind = np.dtype([("t", "<i8"), ("y", "<f4", 6)])
    rows = [np.array((20000 * k, np.arange(6) + k), kind).tobytes() for k in range(5)]
    path = tmp_path / "array.bpr"
    path.write_bytes(encode_json("H", 0, header) + b"".join(encode("D", 1 + k, r) for k, r in enumerate(rows)))
    found = read_array_log(path, load_array("gradiometer"))
    assert found["b"]["z_lsb"].tolist() == [5.0, 6.0, 7.0, 8.0, 9.0]
    assert found["a"]["t_s"] == pytest.approx(0.02 * np.arange(5))


def test_a_row_that_one_sensor_lacks_is_left_out_of_all(logs, tmp_path):
    lines = Path(logs["run"]).read_text().splitlines()
    cells = lines[5].split(",")
    cells[5] = ""
    path = tmp_path / "gap.csv"
    path.write_text("\n".join([*lines[:5], ",".join(cells), *lines[6:]]) + "\n")
    found = read_array_log(path, load_array("gradiometer"))
    assert found["a"].n == found["b"].n == len(lines) - 2


def test_rotation_brings_frames_together():
    rng = np.random.default_rng(1)
    seen = scattered(50, rng)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    assert np.allclose(rotation(seen, turn @ seen), turn)


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ('name = "b"', 'name = "a"', "different names"),
        ('name = "b"', 'name = "B 2"', "small letters"),
        ("[200.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]", "different places"),
        ("position_mm = [200", "position_cm = [200", "position_mm"),
        ('sensor = "hmc1021_1022"', 'sensor = "hmc9"', "hmc"),
    ],
)
def test_array_files_that_cannot_be(tmp_path, old, new, reason):
    path = tmp_path / "array.toml"
    path.write_text(TEXT.replace(old, new))
    with pytest.raises(InputError, match=reason):
        load_array(path)


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ('cs_pin = "X2"', 'cs_pin = ""', "cs_pin of b must be a pin of the PYBV11"),
        ('cs_pin = "X2"', 'cs_pin = "X5"', "cs_pin of b must be a pin of its own"),
        ("series_ohm = 300.0", "series_ohm = 350.0", "2 coils in series"),
        ("strap_supply_v = 32.0", "strap_supply_v = 16.0", "six straps"),
        ("sample_hz = 4000", "sample_hz = 8000", "the frames' time"),
        ('mcu = "STM32F405RG"', 'name = "other"', "left to"),
    ],
)
def test_boards_of_arrays_that_cannot_be(tmp_path, old, new, reason):
    assert load_array_board("gradiometer").in_series == 2
    path = tmp_path / "array.toml"
    path.write_text(TEXT.replace(old, new))
    with pytest.raises(BarberpoleError, match=reason):
        load_array_board(path)
    assert load_array(path).names == ("a", "b")  # the host's side does not ask


def test_the_board_of_an_array_is_explained_pin_by_pin(capsys):
    assert command(["board", "check", "gradiometer", "--json"]) == 0
    pins = {pin["key"]: pin["port"] for pin in json.loads(capsys.readouterr().out)["pins"]}
    assert pins["cs_pin of b"] == "PA1"
    assert pins["adc.cs_pin"] != "PA1"


def test_an_array_without_a_board_is_not_built(tmp_path):
    path = tmp_path / "array.toml"
    path.write_text(TEXT[: TEXT.index("[board]")])
    with pytest.raises(InputError, match="tables of a board"):
        load_array_board(path)


def test_refusals(logs, tmp_path, capsys):
    assert command(["array", "calibrate", logs["seen"], "-o", str(tmp_path / "c.toml")]) == 2
    assert "surround" in capsys.readouterr().err
    told(capsys, "calibrate", logs["turned"], "-o", str(tmp_path / "c.toml"))
    words = [
        "array",
        "selfcal",
        logs["later"],
        "--calibration",
        str(tmp_path / "c.toml"),
        "-o",
        str(tmp_path / "d.toml"),
    ]
    assert command(words) == 2
    assert "coil run" in capsys.readouterr().err
    assert not (tmp_path / "d.toml").exists()
    (tmp_path / "one.csv").write_text("t_s,a_x_lsb,a_y_lsb,a_z_lsb\n0,1,2,3\n")
    assert command(["array", "gradient", str(tmp_path / "one.csv"), "--calibration", str(tmp_path / "c.toml")]) == 2
    assert "b_x_lsb" in capsys.readouterr().err


def test_simulated_logs_hide_a_drift_that_the_coil_run_finds(tmp_path, capsys):
    hidden = told(capsys, "simulate", "-o", str(tmp_path))["hidden_gain"]
    then, now = str(tmp_path / "then.toml"), str(tmp_path / "now.toml")
    turned, run, later = (str(tmp_path / f"{name}.csv") for name in ("turned", "run", "later"))
    told(capsys, "calibrate", turned, "--run", run, "--magnitude", "47.9165", "-o", then)
    found = told(capsys, "selfcal", later, "--calibration", then, "-o", now)["sensors"]
    assert all(found[n]["gain"] == pytest.approx(hidden[n], abs=2e-5) for n in "ab")
    seen = told(capsys, "gradient", str(tmp_path / "seen.csv"), "--calibration", now)["gradients"][0]
    assert seen["mean_nt_per_m"] == pytest.approx([300.0, -150.0, 80.0], abs=25.0)
