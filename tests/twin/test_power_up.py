"""The built firmware on the emulated board: what it finds at power-up, and what no fault or pulled plug can take."""

import random
import time

import numpy as np
import pytest
from barberpole.demo.bench import TRUE_EFFECTS, Bench, scale_at_reference
from barberpole.link.deploy import pull
from barberpole.link.record import record
from barberpole.log import read_log
from barberpole.reasons import reason
from barberpole.records import RESULT, decode
from barberpole.twin.world import World
from barberpole.verify import verify

GAIN_DRIFT = (1.004, 0.997, 1.002)
PATIENCE_S = 20.0
FLOAT32 = 1.2e-7  # the slots hold float32; the interpreter here computes in double
SEEDS = 20
CUTS = 30
REASON = {
    "coil_open_x": "coil_current",
    "coil_short_y": "coil_current",
    "adc_stuck": "adc_stuck",
    "adc_silent": "adc_silent",
    "wrong_chip": "wrong_chip",
    "dac_silent": "wrong_chip",
    "ambient_step": "ambient_step",
    "supply_low": "supply_low",
}


@pytest.fixture(scope="module")
def bench(calibrated):
    return calibrated[0]


@pytest.fixture(scope="module")
def calibration(calibrated):
    return calibrated[1]


@pytest.fixture(scope="module")
def board(bench, calibration):
    """The board with its calibration on it, in an unshielded field, its gains a little off the factory's."""
    with bench.on(World.of(bench.board, TRUE_EFFECTS, gain_drift=GAIN_DRIFT)) as twin:
        bench.deploy(twin, calibration, "build")
        yield twin


def power_up(twin, **how):
    """The verdict of one power-up, out of what the board says."""
    said = twin.said()
    twin.power_cycle(**({"faults": ()} | how))
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        results = [f.json for f in decode(twin.said_since(said).encode()).frames if f.type == RESULT]
        if results:
            return results[-1]
        time.sleep(0.02)
    raise AssertionError(f"no verdict: {twin.said_since(said)[-2000:]}")


def truth_ppm(twin, calibration, result):
    factory = np.array([calibration.parameters[f"scale.{axis}"].value for axis in "xyz"])
    return 1e6 * (factory * result["in_force_gain"] / scale_at_reference(twin.truth(), calibration.t0_c) - 1)


def names(result):
    return [reason(code).name for code in result["reasons"]]


def test_gains_repeat_and_agree_with_the_truth(board, calibration):
    errors = []
    for seed in range(SEEDS):
        result = power_up(board, seed=seed)
        assert result["accepted"], names(result)
        assert result["duration_s"] <= 2.0
        errors.append(truth_ppm(board, calibration, result))
    assert np.max(np.abs(errors)) < 200.0
    assert np.max(np.ptp(errors, axis=0)) < 60.0


def test_board_in_float32_and_host_in_double_agree_on_the_same_points(board, calibration, tmp_path):
    power_up(board, seed=3)
    pull(board.port, tmp_path / "run.bpr")
    found = verify(read_log(tmp_path / "run.bpr"), calibration)
    assert found.passed, found.to_json()
    assert found.to_json()["board_against_host_ppm"] < 10.0


def test_a_board_without_its_coil_driver_streams(board, tmp_path):
    assert names(power_up(board, faults=("dac_silent",))) == ["wrong_chip"]
    record(board.port, tmp_path / "log.bpr", frames=20)
    assert read_log(tmp_path / "log.bpr").n >= 15


def test_a_host_that_joins_later_reads_the_stream(board, calibration, tmp_path):
    """Header and verdict are said again: what runs, which gains are in force, and what the columns are."""
    result = power_up(board, seed=4)
    record(board.port, tmp_path / "late.bpr", frames=600)
    log = read_log(tmp_path / "late.bpr")
    assert log.n > 590  # the others: header, verdict, as much of the coil run as nobody had read
    assert log.skipped <= 1
    assert np.median(np.diff(log["t_s"])) == pytest.approx(0.005, rel=0.01)
    assert log.meta["calibration"] == calibration.hash
    assert log.meta["result"]["in_force_gain"] == result["in_force_gain"]
    assert verify(log, calibration).to_json()["running"] == calibration.hash


@pytest.mark.parametrize("fault", REASON)
def test_a_fault_is_refused_with_its_reason_and_the_last_good_one_stays(board, fault):
    good = power_up(board, seed=1)
    result = power_up(board, seed=2, faults=(fault,))
    assert not result["accepted"]
    assert REASON[fault] in names(result)
    assert (result["in_force"], result["seq"]) == (good["in_force"], good["seq"])
    assert result["in_force_gain"] == pytest.approx(good["in_force_gain"], rel=FLOAT32)


def test_the_plug_pulled_at_any_moment_leaves_a_valid_calibration(board, calibration):
    moments = random.Random(11)
    for number in range(CUTS):
        board.power_cycle(seed=number, faults=(), cut_s=moments.uniform(0.0, 1.9))
        while board.is_on:
            time.sleep(0.01)
        # with an open coil nothing new is stored: what is in force is what the interrupted power-up left behind
        result = power_up(board, seed=number, faults=("coil_open_x",))
        assert result["in_force"] in ("slot a", "slot b", "factory")
        assert "store_corrupt" not in names(result)
        if result["in_force"] != "factory":
            assert np.max(np.abs(truth_ppm(board, calibration, result))) < 200.0


def test_the_plug_pulled_before_anything_was_stored_leaves_the_factory_calibration(bench, calibration):
    fresh = Bench(bench.board, bench.folder / "fresh", seed=1, say=lambda _: None)
    fresh.folder.mkdir()
    with fresh.on(World.of(bench.board, TRUE_EFFECTS)) as twin:
        fresh.deploy(twin, calibration, "build")
        twin.power_cycle(cut_s=0.5)
        while twin.is_on:
            time.sleep(0.01)
        result = power_up(twin, faults=("coil_open_x",))
        assert result["in_force"] == "factory"
        assert result["in_force_gain"] == [1.0, 1.0, 1.0]
