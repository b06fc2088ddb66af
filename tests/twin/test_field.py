"""The board in the field: every fault ends in a state with its reason, commands are answered while it streams."""

import json
import time
from dataclasses import replace

import numpy as np
import pytest
import serial
from barberpole.board import load_board
from barberpole.demo.bench import Bench
from barberpole.errors import PortError
from barberpole.link.listen import ask, listening
from barberpole.link.monitor import seconds
from barberpole.nominal import nominal
from barberpole.records import ANSWER, ROWS
from barberpole.twin import Twin
from barberpole.twin.world import World

PATIENCE_S = 20.0
FAULTS = {  # fault: state, reason
    "coil_open_x": ("streaming", "coil_current"),
    "coil_open_y": ("streaming", "coil_current"),
    "coil_open_z": ("streaming", "coil_current"),
    "coil_short_x": ("streaming", "coil_current"),
    "coil_short_y": ("streaming", "coil_current"),
    "coil_short_z": ("streaming", "coil_current"),
    "adc_stuck": ("fault", "adc_stuck"),
    "adc_silent": ("fault", "adc_silent"),
    "wrong_chip": ("fault", "wrong_chip"),
    "dac_silent": ("streaming", "wrong_chip"),
    "supply_low": ("streaming", "supply_low"),
    "ambient_step": ("streaming", "ambient_step"),
    "flash_full": ("streaming", "store_failed"),
    "store_corrupt": ("streaming", "store_corrupt"),
}


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    return Bench(load_board("pybv11"), tmp_path_factory.mktemp("field"), seed=5, say=lambda _: None)


@pytest.fixture(scope="module")
def twin(bench):
    with bench.on(World.of(bench.board)) as twin:
        bench.deploy(twin, nominal(bench.board), "build")
        yield twin


def power_up(twin, **how):
    """Off and on; the status as soon as the board can tell it."""
    twin.power_cycle(**({"faults": ()} | how))
    return asked(twin, "status")


def asked(twin, command):
    return ask(twin.port, command)[-1]


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_ends_in_a_state_with_its_reason_in_status_and_log(twin, fault):
    state, reason = FAULTS[fault]
    if fault == "store_corrupt":
        power_up(twin)  # so that there is something to spoil
    status = power_up(twin, faults=(fault,))
    assert (status["state"], status["done"]) == (state, True)
    assert reason in status["names"]
    boot = status["boot"]
    if fault == "flash_full":
        assert status["log_failed"]  # there is no room for the log either: only the status can say so
        assert not power_up(twin)["log_failed"]
        return
    entries = [answer["entry"] for answer in ask(twin.port, "read log")[:-1]]
    of_this = [entry for entry in entries if entry["boot"] == boot]
    assert reason in [entry["name"] for entry in of_this]
    assert all(entry["text"] for entry in of_this)
    if reason == "coil_current":  # a refused run is explained in figures
        ratio = next(entry for entry in of_this if entry["name"] == reason)["current_ratio"]
        axis = "xyz".index(fault[-1])
        assert abs(ratio[axis] - 1.0) > 0.1
        assert np.abs(np.delete(ratio, axis) - 1.0).max() < 0.01


def test_commands_are_answered_while_it_streams(twin):
    status = power_up(twin, seed=2)
    assert (status["state"], status["in_force"]) == ("streaming", asked(twin, "read cal")["in_force"])
    assert status["rows"] > 0
    assert status["memory_free"] > 4096
    assert status["lost_cycles"] == 0
    assert asked(twin, "status")["uptime_s"] > status["uptime_s"]
    again = asked(twin, "selfcal now")
    assert again["verdict"]["accepted"]
    assert again["verdict"]["seq"] == status["seq"] + 1
    assert asked(twin, "stop")["state"] == "stopped"
    at_rest = asked(twin, "status")["rows"]
    assert asked(twin, "status")["rows"] == at_rest
    assert asked(twin, "stream")["state"] == "streaming"
    assert asked(twin, "status")["rows"] > at_rest
    reset = asked(twin, "factory reset")
    assert (reset["in_force"], asked(twin, "read cal")["seq"]) == ("factory", 0)
    assert power_up(twin, faults=("coil_open_x",))["in_force"] == "factory"  # nothing new is stored


def test_what_is_no_command_is_said(twin):
    power_up(twin)
    with listening(twin.port) as board:
        board.send("statis")
        until = time.monotonic() + PATIENCE_S
        answers = []
        while not answers and time.monotonic() < until:
            answers = [f.json for f in board.frames() if f.type == ANSWER]
    assert answers
    assert not answers[0]["done"]
    assert "one of factory reset, read cal" in answers[0]["text"]


def test_mpremote_gets_its_prompt_from_a_streaming_board(twin, mpremote):
    power_up(twin)
    assert mpremote(twin, "exec", "print(6 * 7)").strip() == "42"
    with pytest.raises(PortError, match="answering `status` within 1 s"):
        ask(twin.port, "status", timeout_s=1.0)


def test_stream_keeps_200_hz(twin, bench):
    power_up(twin)
    with listening(twin.port) as board:
        rows: list[int] = []
        while len(rows) < 400:
            rows += [int.from_bytes(f.payload[:8], "little") for f in board.frames() if f.type == ROWS]
    between_us = np.diff(rows)
    assert np.mean(between_us) == pytest.approx(1e6 / bench.board.flip.rate_hz, rel=0.02)
    assert np.median(between_us) == pytest.approx(1e6 / bench.board.flip.rate_hz, abs=5)


def test_monitor_hears_field_rate_and_verdict(twin):
    power_up(twin, seed=9)
    with listening(twin.port) as board:
        told = seconds(board, 0.5)
        first, second = next(told), next(told)
    assert second.rate_hz == pytest.approx(200.0, rel=0.02)
    assert first.accepted
    assert first.b_ut == pytest.approx(float(np.linalg.norm(first.field_ut)), rel=1e-6)
    assert 1.0 < second.b_ut < 100.0
    assert second.temp_c == pytest.approx(25.0, abs=1.0)
    assert json.dumps(second.to_json())


def test_monitor_tells_an_unplugged_or_silent_board(tmp_path):
    with pytest.raises(PortError, match="which does not exist"), listening(str(tmp_path / "none")):
        pass


@pytest.fixture(scope="module")
def guarded(tmp_path_factory):
    """A board whose file asks for a watchdog."""
    board = replace(load_board("pybv11"), watchdog_s=4.0)
    bench = Bench(board, tmp_path_factory.mktemp("guarded"), seed=5, say=lambda _: None)
    with bench.on(World.of(bench.board)) as twin:
        bench.deploy(twin, nominal(board), "build")
        assert not asked(twin, "status")["watchdog"]  # a host has restarted it
        yield twin


def test_watchdog_runs_after_power_up_and_leaves_a_host_alone(guarded, mpremote):
    assert power_up(guarded)["watchdog"]
    with serial.Serial(guarded.port, 115200) as line:
        line.write(b"\r\x03")  # as mpremote begins; on a real board the port goes away now
    until = time.monotonic() + PATIENCE_S
    while "the board restarts without it" not in guarded.log_text:
        assert time.monotonic() < until
        time.sleep(0.05)
    status = asked(guarded, "status")
    assert (status["watchdog"], status["state"]) == (False, "streaming")
    assert mpremote(guarded, "exec", "print(6 * 7)").strip() == "42"


STUCK = """
import machine, time
dog = machine.WDT(timeout=4000)
print("cause", machine.reset_cause())
while True:
    time.sleep_ms(5)
"""


def test_watchdog_bites_a_program_that_stands_still(bench, tmp_path):
    program = tmp_path / "main.py"
    program.write_text(STUCK)
    with Twin(bench.board, tmp_path / "flash", files={"/main.py": program}) as twin:
        twin.wait_until(5.0)
        until = time.monotonic() + PATIENCE_S
        while "cause 3" not in twin.log_text:
            assert time.monotonic() < until, twin.log_text
            time.sleep(0.02)
        assert "cause 1" in twin.log_text
