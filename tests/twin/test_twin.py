"""Programs on the emulated board: time, determinism, power."""

import os
import re
import signal
import subprocess
import sys
import textwrap
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from barberpole.board import load_board
from barberpole.errors import InputError, PortError
from barberpole.twin import FAULTS, Fixed, Twin, World

END = "end of readings"


def readings(log):
    """(rows, 8) averages that programs/readings.py printed last, whatever prompt stands before them."""
    lines = log[: log.rindex(END)].splitlines()[-6:]
    return np.array([[float(value) for value in re.findall(r"-?\d+\.\d{3}", line)] for line in lines])


def alive(pid):
    """Whether a process is there and no zombie."""
    status = Path(f"/proc/{pid}/status")
    return status.exists() and "\nState:\tZ" not in status.read_text()


def test_readings_are_the_truth_within_noise(start, board, said):
    twin = start("readings.py", world=World.of(board, ("none",), ambient=Fixed((20.0, -30.0, 40.0))), seed=1)
    rows, truth = readings(said(twin, END)), twin.truth()
    demodulated = (rows[::2, :3] - rows[1::2, :3]) / 2.0
    expected = np.array(truth["scale_lsb_per_ut"]) * [20.0, -30.0, 40.0] + truth["bias_lsb"]
    noise = np.array(truth["noise_lsb"]) / np.sqrt(2.0)
    assert np.all(np.abs(demodulated - expected) < 4.5 * noise)  # nine values
    electronic = (rows[::2, :3] + rows[1::2, :3]) / 2.0
    assert np.all(np.abs(electronic - truth["offset_lsb"]) < 4.5 * noise)
    assert truth["incidents"] == []


def test_same_seed_same_readings(start, tmp_path, said):
    logs = []
    for name, seed in (("a", 3), ("b", 3), ("c", 4)):
        twin = start("readings.py", flash_dir=tmp_path / name, seed=seed)
        logs.append((readings(said(twin, END)).tolist(), twin.virtual_time_s()))
        twin.close()
    assert logs[0] == logs[1]
    assert logs[0][0] != logs[2][0]


def test_power_cycle_starts_time_and_noise_anew_and_keeps_the_flash(start, said, mpremote):
    twin = start("readings.py", seed=3)
    first = readings(said(twin, END))
    mpremote(twin, "exec", "open('mark','w').write('x')")
    stopped_s = twin.virtual_time_s()
    twin.power_cycle()
    assert not np.array_equal(first, readings(said(twin, END, count=2)))
    assert twin.virtual_time_s() < stopped_s
    assert "mark" in mpremote(twin, "ls")


def test_board_time_does_not_follow_the_pcs(start):
    twin = start()
    time.sleep(0.3)
    before = twin.virtual_time_s()
    time.sleep(0.3)
    assert twin.virtual_time_s() == before
    with pytest.raises(PortError, match="clock must be at 5 s within"):
        twin.wait_until(5.0, timeout_s=0.2)


def test_sleep_and_ticks_agree(start, mpremote):
    program = (
        "import time; t=time.ticks_us(); m=time.ticks_ms(); time.sleep_ms(2000); time.sleep_us(7); time.sleep(0.5)"
    )
    program += "; print(time.ticks_diff(time.ticks_us(), t), time.ticks_diff(time.ticks_ms(), m))"
    us, ms = map(int, mpremote(start(), "exec", program).split())
    assert 2500007 <= us < 2500050
    assert 2500 <= ms <= 2501


def test_ticks_wrap_as_on_the_board(start, mpremote):
    program = "import time; t=time.ticks_us(); time.sleep(1100); print(time.ticks_us() < 1 << 30, "
    program += "time.ticks_diff(time.ticks_add(5, -10), 5), time.ticks_diff(3, (1 << 30) - 2))"
    assert mpremote(start(), "exec", program).split() == ["True", "-10", "5"]


def test_power_cycles_in_quick_succession(start, said):
    """Descriptors of one start come back as those of the next: no event may be mistaken for another's."""
    twin = start("forever.py")
    for n in range(12):
        twin.power_cycle()
        if n % 3:
            twin.wait_until(0.05)
    twin.wait_until(0.5)
    assert twin.is_on


def test_kill_and_power_cycle_at_any_moment_keep_the_files(start, mpremote):
    twin = start("writer.py")
    for n in range(6):
        twin.power_cycle()
        time.sleep(0.15 + 0.037 * n)
        twin.kill()
        assert not twin.is_on
    twin.power_cycle()
    twin.wait_until(0.1)
    words = mpremote(twin, "cat", "kept").split()
    assert len(words) == 300
    assert len(set(words)) == 1


def test_power_is_cut_at_a_board_time(start, said):
    twin = start("forever.py")
    twin.power_cycle(cut_s=0.1034)
    until = time.monotonic() + 5.0
    while twin.is_on:
        assert time.monotonic() < until
        time.sleep(0.01)
    assert twin.log_text.rstrip().endswith("row 20")
    assert twin.virtual_time_s() < 0.1034
    twin.power_cycle()
    twin.wait_until(0.5)
    assert twin.is_on


def test_crash_of_the_interpreter_restarts_the_board(start, mpremote):
    twin = start()
    os.kill(twin._ask("pid"), signal.SIGSEGV)
    time.sleep(0.3)
    assert "crashed (signal 11)" in twin.log_text
    assert mpremote(twin, "eval", "6*7") == "42\n"


def test_nothing_is_left_behind(start):
    twin = start("forever.py")
    board_pid, interpreter_pid = twin._process.pid, twin._ask("pid")
    twin.close()
    assert not alive(board_pid)
    assert not alive(interpreter_pid)
    with pytest.raises(InputError, match="inside its with statement"):
        twin.truth()


@pytest.mark.parametrize("victim", ["owner", "board"])
def test_nothing_survives_a_killed_process(tmp_path, victim):
    """The owner of a board killed outright, or the board's own process: interpreter and all end."""
    program = f"""
        import time
        from barberpole.board import load_board
        from barberpole.twin import Twin
        with Twin(load_board("pybv11"), {str(tmp_path)!r}) as twin:
            print(twin._process.pid, twin._ask("pid"), flush=True)
            time.sleep(60)
    """
    owner = subprocess.Popen([sys.executable, "-c", textwrap.dedent(program)], stdout=subprocess.PIPE, text=True)
    board_pid, interpreter_pid = map(int, owner.stdout.readline().split())
    os.kill(owner.pid if victim == "owner" else board_pid, signal.SIGKILL)
    until = time.monotonic() + 5.0
    while alive(interpreter_pid) or (victim == "owner" and alive(board_pid)):
        assert time.monotonic() < until
        time.sleep(0.02)
    owner.kill()
    owner.wait()


def test_what_the_pyboard_does_not_have_is_refused(board, tmp_path):
    with pytest.raises(InputError, match="a pin of the emulated board must be one of the pyboard's; got PA99"):
        Twin(replace(board, flip=replace(board.flip, set_pin="PA99")), tmp_path)
    with pytest.raises(InputError, match=r"SPI bus .* must be 1 or 2; got 3"):
        Twin(replace(board, adc=replace(board.adc, spi=3)), tmp_path)
    with pytest.raises(InputError, match="the seed must be 0 or more; got -1"):
        Twin(board, tmp_path, seed=-1)


def test_parts_that_are_not_emulated_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"must be one with the ads131m08 .* like pybv11; got stm32f4_adc"):
        Twin(load_board("pybv11_timed"), tmp_path)


def test_every_fault_has_a_name_and_others_are_refused(board, tmp_path):
    for name in ("coil_open_x", "coil_short_z", "adc_stuck", "adc_silent", "wrong_chip", "ambient_step", "supply_low"):
        assert name in FAULTS
    with pytest.raises(InputError, match=r"the fault must be one of .*'coil_open'"):
        Twin(board, tmp_path, faults=("coil_open",))


def test_faults_reach_the_program(start, said):
    twin = start("readings.py", faults=("supply_low",))
    rows = readings(said(twin, END))
    assert np.allclose(rows[0, :3], rows[1, :3], atol=200.0)  # noise only: nothing flips
    assert rows[0, 7] * 1.2 / 2**23 / 0.05 == pytest.approx(9.6, rel=1e-3)
    assert twin.truth()["faults"] == ["supply_low"]
    twin.power_cycle(faults=())
    rows = readings(said(twin, END, count=2))
    assert not np.allclose(rows[0, :3], rows[1, :3], atol=200.0)
    assert twin.truth()["faults"] == []


def test_files_that_do_not_fit_are_refused(board, tmp_path):
    big = tmp_path / "big"
    big.write_bytes(bytes(200 * 1024))
    with pytest.raises(InputError, match="small enough for its flash"), Twin(board, tmp_path, files={"/big": big}):
        pass
