"""A gradiometer whole: two sensors on one emulated board, built, flashed, calibrated in one coil run; its gradient."""

import json
import time

import numpy as np
import pytest
from barberpole import paths
from barberpole.arrays.array_file import load_array, load_array_board
from barberpole.arrays.array_log import read_array_log
from barberpole.board import load_board
from barberpole.board_log import read_board_log
from barberpole.cli import run as command
from barberpole.errors import InputError
from barberpole.link.deploy import flash, pull
from barberpole.link.listen import ask
from barberpole.link.record import record
from barberpole.log_formats import write_csv
from barberpole.nominal import nominal
from barberpole.reasons import reason
from barberpole.records import ANSWER, RESULT, decode
from barberpole.twin.ambient import Stations
from barberpole.twin.api import Twin
from barberpole.twin.array_world import ArrayWorld
from barberpole_codegen.array import build_array

HIDDEN = ("misalignment",)
K_UT = 48.0
DRIFT = {"a": (1.004, 0.997, 1.002), "b": (0.996, 1.003, 0.9985)}
GRADIENT_NT_PER_M = (300.0, -150.0, 80.0)
STATIONS, HOLD_S, REST_S, GUARD_S = 60, 0.05, 1.0, 0.011
TURNED_ROWS, SEEN_ROWS = 340, 120
PATIENCE_S = 30.0
PPM = 150.0
"""Of a gain: 36 points of 10 ms with 4 nT of noise over 60 µT rms are 12 ppm; the rest is what the turned log left."""


GRADIENT_OFF_NT_PER_M = 25.0
"""Two coil runs of 12 ppm and sqrt(2) sensors over 44 µT and 20 cm are 5 nT/m; the rest is alignment by turning."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("array")


@pytest.fixture(scope="module")
def file(folder):
    """The gradiometer with a shorter coil run: 36 points."""
    text = (paths.boards() / "arrays" / "gradiometer.toml").read_text()
    (folder / "gradiometer.toml").write_text(text.replace("points = 132", "points = 36"))
    return folder / "gradiometer.toml"


@pytest.fixture(scope="module")
def board(file):
    return load_array_board(file)


@pytest.fixture(scope="module")
def bench(board, folder):
    """The board with data-sheet values on it: a power-up at rest, then turned, by steps, in one magnitude."""
    fields = Stations.on_sphere(STATIONS, (K_UT,), hold_s=HOLD_S, first_s=REST_S)
    with Twin(board, folder / "flash", ArrayWorld.of(board, HIDDEN, fields), seed=5) as twin:
        build_array(board, dict.fromkeys("ab", nominal(board)), folder / "nominal")
        assert flash(folder / "nominal", twin.port).passed
        record(twin.port, folder / "turned.bpr", TURNED_ROWS, start=lambda _: twin.power_cycle())
        pull(twin.port, folder / "run.bpr")
        found = read_board_log((folder / "turned.bpr").read_bytes(), "turned.bpr").columns
        steady = twin.world.worlds[0].steady(found["t_s"], GUARD_S) & (found["t_s"] > REST_S)
        (folder / "turned.csv").write_bytes(write_csv({name: column[steady] for name, column in found.items()}))
        yield twin


@pytest.fixture(scope="module")
def then(bench, folder):
    """Calibrated by turning, with the coil run of that day."""
    words = ["array", "calibrate", str(folder / "turned.csv"), "--run", str(folder / "run.bpr")]
    assert command([*words, "--magnitude", f"{K_UT}", "-o", str(folder / "then.toml")]) == 0
    return folder / "then.toml"


@pytest.fixture(scope="module")
def later(bench, board, file, then, folder):
    """The board with that calibration, its gains drifted, in a gradient."""
    assert command(["build", str(file), "--calibration", str(then), "-o", str(folder / "built")]) == 0
    assert flash(folder / "built", bench.port).passed
    world = ArrayWorld.of(board, HIDDEN, gradient_nt_per_m=GRADIENT_NT_PER_M, gain_drift=DRIFT)
    record(bench.port, folder / "seen.bpr", SEEN_ROWS, start=lambda _: bench.power_cycle(world=world))
    pull(bench.port, folder / "today.bpr")
    return bench


def told(capsys, *words):
    capsys.readouterr()
    assert command(["array", *map(str, words), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def power_up(twin, **how):
    """All frames of one power-up up to its verdict, which is the last."""
    said = len(twin.log_text)
    twin.power_cycle(**({"faults": ()} | how))
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        frames = decode(twin.log_text[said:].encode()).frames
        if any(f.type == RESULT for f in frames):
            return next(f.json for f in frames if f.type == RESULT)
        time.sleep(0.02)
    raise AssertionError(twin.log_text[said:][-2000:])


def names(verdict):
    return [reason(code).name for code in verdict["reasons"]]


def test_one_power_up_accepts_both_and_finds_their_drift(later, folder):
    verdict = read_array_log(folder / "seen.bpr", load_array("gradiometer"))["a"].meta["result"]
    assert verdict["accepted"], verdict
    assert verdict["duration_s"] < 2.5
    for name, of in verdict["sensors"].items():
        assert of["in_force"] == "slot a"
        error_ppm = 1e6 * (np.array(of["in_force_gain"]) / DRIFT[name] - 1.0)
        assert np.max(np.abs(error_ppm)) < PPM


def test_the_host_finds_the_same_from_the_run_in_the_flash_and_the_gradient(later, then, folder, capsys):
    now = folder / "now.toml"
    found = told(capsys, "selfcal", folder / "today.bpr", "--calibration", then, "-o", now)["sensors"]
    for name, of in found.items():
        assert np.max(np.abs(1e6 * (np.array(of["gain"]) / DRIFT[name] - 1.0))) < PPM
    seen, stale = (
        told(capsys, "gradient", folder / "seen.bpr", "--calibration", used)["gradients"][0] for used in (now, then)
    )
    assert (seen["baseline_m"], seen["direction"]) == (pytest.approx(0.2), [1.0, 0.0, 0.0])
    off = [np.max(np.abs(np.array(g["mean_nt_per_m"]) - GRADIENT_NT_PER_M)) for g in (seen, stale)]
    assert off[0] < GRADIENT_OFF_NT_PER_M
    assert off[1] > 500.0  # 0.4 % of 44 µT over 20 cm
    assert seen["rms_change_nt_per_m"] == pytest.approx([row_noise(later)] * 3, rel=0.25)


def row_noise(twin):
    """nT/m of one row: SET and RESET of both sensors are averaged over the baseline."""
    truth = twin.truth()["sensors"]["a"]
    return 1000.0 * truth["noise_lsb"][0] / truth["scale_lsb_per_ut"][0] / 0.2


def test_the_board_compensates_each_sensor(later, folder):
    """The fields that the board itself says differ by the gradient too."""
    logs = read_array_log(folder / "seen.bpr", load_array("gradiometer"))
    apart = [np.mean(logs["b"][f"c{axis}_ut"] - logs["a"][f"c{axis}_ut"]) for axis in "xyz"]
    assert 5000.0 * np.array(apart) == pytest.approx(np.array(GRADIENT_NT_PER_M), abs=GRADIENT_OFF_NT_PER_M)


def asked(twin, line):
    return ask(twin.port, line)[-1]


def test_each_sensor_says_what_its_calibration_is(later):
    power_up(later)
    read = asked(later, "read cal")
    assert read["done"]
    assert sorted(read["sensors"]) == ["a", "b"]
    status = asked(later, "status")["sensors"]
    for name, of in read["sensors"].items():
        assert (of["in_force"], of["seq"]) == (status[name]["in_force"], status[name]["seq"])
        assert of["gain"] == status[name]["in_force_gain"]
        assert of["gain"] == pytest.approx([1.0] * 3, abs=0.01)
    assert read["sensors"]["a"]["calibration"] != read["sensors"]["b"]["calibration"]


def asked_for_status(twin, path):
    """Rows as columns, and the answer to `status`."""
    record(twin.port, path, 300, start=lambda line: line.write(b"status\r"))
    frames = decode(path.read_bytes()).frames
    return read_board_log(path.read_bytes(), path).columns, next(f.json for f in frames if f.type == ANSWER)


@pytest.mark.parametrize(
    ("fault", "silent", "reasons"),
    [
        ("second_adc_silent", "b", {"a": [], "b": ["adc_silent"]}),
        ("second_wrong_chip", "b", {"a": [], "b": ["wrong_chip"]}),
        ("second_adc_stuck", "b", {"a": [], "b": ["adc_stuck"]}),
        ("adc_silent", "a", {"a": ["adc_silent"], "b": ["coil_current"]}),
    ],
)
def test_a_sensor_without_samples_has_its_reason_and_the_other_streams(later, folder, fault, silent, reasons):
    verdict = power_up(later, faults=(fault,))
    assert not verdict["accepted"]
    assert {name: names(of) for name, of in verdict["sensors"].items()} == reasons
    assert verdict["sensors"]["a"]["accepted"] == (silent == "b")  # the first one reads the currents for all
    assert verdict["sensors"][silent]["in_force"] != "factory"  # what was in force stays
    columns, status = asked_for_status(later, folder / "fault.bpr")
    assert status["state"] == "streaming"
    assert {name: of["state"] for name, of in status["sensors"].items()} == {
        name: "fault" if name == silent else "sampling" for name in "ab"
    }
    assert {name: of["names"] for name, of in status["sensors"].items()} == reasons
    other = "a" if silent == "b" else "b"
    assert np.all(np.isfinite(columns[f"{other}_cx_ut"]))
    assert np.all(np.isnan(columns[f"{silent}_x_set_lsb"]))
    with pytest.raises(InputError, match=f"sensor {silent} must be one with readings"):
        read_array_log(folder / "fault.bpr", load_array("gradiometer"))


def test_what_is_wrong_with_all_is_said_of_the_board(later):
    verdict = power_up(later, faults=("coil_open_x",))
    assert {name: names(of) for name, of in verdict["sensors"].items()} == {
        name: ["coil_current", "gain_drift"] for name in "ab"
    }
    assert names(power_up(later, faults=("supply_low",))) == ["supply_low"]


def test_commands_are_answered_while_it_streams(later):
    power_up(later)
    before = asked(later, "status")
    assert (before["state"], before["names"]) == ("streaming", [])
    again = asked(later, "selfcal now")
    assert (again["done"], again["verdict"]["accepted"]) == (True, True)
    assert {name: of["seq"] - before["sensors"][name]["seq"] for name, of in again["verdict"]["sensors"].items()} == {
        "a": 1,
        "b": 1,
    }
    assert asked(later, "stop")["state"] == "stopped"
    at_rest = asked(later, "status")["rows"]
    assert asked(later, "status")["rows"] == at_rest
    assert (asked(later, "stream")["done"], asked(later, "status")["rows"] > at_rest) == (True, True)
    refused = asked(later, "read all")
    assert not refused["done"]
    assert refused["text"].endswith("factory reset, read cal, read log, selfcal now, status, stop, stream")


def test_a_factory_reset_is_of_all_sensors_and_in_the_log(later):
    power_up(later)
    assert asked(later, "selfcal now")["done"]
    assert asked(later, "factory reset")["done"]
    status = asked(later, "status")
    assert names(status) == ["factory_reset"]
    assert {(of["in_force"], of["seq"], *of["in_force_gain"]) for of in status["sensors"].values()} == {
        ("factory", 0, 1.0, 1.0, 1.0)
    }
    *answers, count = ask(later.port, "read log")
    assert (count["entries"], count["dropped"]) == (len(answers), 0)
    assert answers[-1]["entry"]["name"] == "factory_reset"
    assert answers[-1]["entry"]["boot"] == status["boot"]
    kept = power_up(later, faults=("coil_open_x",))  # nothing new is stored
    assert {of["in_force"] for of in kept["sensors"].values()} == {"factory"}


def test_a_fault_of_the_second_sensor_needs_one(folder):
    with pytest.raises(InputError, match="one sensor"):
        Twin(load_board("pybv11"), folder / "none", faults=("second_adc_silent",))
