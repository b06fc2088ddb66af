"""Recording over a cable: the file is there when it is whole, and whatever ends a recording leaves no half of one."""

import os
import resource
import subprocess
import threading
import tty
from pathlib import Path

import pytest
from barberpole.challenge.record import Recipe
from barberpole.challenge.record import record as record_truth
from barberpole.cli import run
from barberpole.commands import board
from barberpole.errors import InputError, PortError
from barberpole.link import record as recording
from barberpole.link.deploy import pull
from barberpole.link.record import record
from barberpole.log import Log, read_log, write_log
from barberpole.records import ROWS, decode, encode
from fuzzing.one import HEADER, header_text, records


@pytest.fixture
def cable():
    """The board's end of a serial cable, as a file descriptor, and the port at the host's end."""
    board, host = os.openpty()
    tty.setraw(host)
    yield board, os.ttyname(host)
    for end in (board, host):
        try:
            os.close(end)
        except OSError:
            continue  # the test unplugged it


@pytest.fixture
def says(cable):
    """says(count): the board sends so many frames as soon as it is asked."""

    def start(count):
        data = b"".join(encode(ROWS, k, bytes(8)) for k in range(count))
        return lambda _: threading.Thread(target=os.write, args=(cable[0], data)).start()

    return start


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_recording_of_so_many_frames(cable, says, tmp_path):
    target = tmp_path / "log.bpr"
    assert record(cable[1], target, frames=5, start=says(9)) == 5
    assert [frame.sequence for frame in decode(target.read_bytes()).frames] == [0, 1, 2, 3, 4]
    assert names(tmp_path) == ["log.bpr"]


def test_ctrl_c_keeps_what_was_recorded(cable, says, tmp_path):
    def tick(_):
        ticks.append(1)
        if len(ticks) == 3:
            raise KeyboardInterrupt

    ticks = []
    assert record(cable[1], tmp_path / "log.bpr", start=says(9), tick=tick, stoppable=True) == 3
    assert len(decode((tmp_path / "log.bpr").read_bytes()).frames) == 3
    ticks.clear()
    with pytest.raises(KeyboardInterrupt):  # what records for a purpose of its own, as the demo does, is ended by it
        record(cable[1], tmp_path / "other.bpr", start=says(9), tick=tick)
    assert names(tmp_path) == ["log.bpr"]


def test_ctrl_c_before_the_first_frame_leaves_nothing(cable, tmp_path):
    def start(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        record(cable[1], tmp_path / "log.bpr", start=start, stoppable=True)
    assert not names(tmp_path)


def test_a_cable_unplugged_keeps_what_was_recorded(cable, says, tmp_path):
    def tick(_):
        os.close(cable[0])

    assert record(cable[1], tmp_path / "log.bpr", start=says(1), tick=tick) == 1


def test_a_full_disk_keeps_the_last_recording_and_what_was_recorded(cable, says, tmp_path):
    target = tmp_path / "log.bpr"
    target.write_bytes(b"of yesterday")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with pytest.raises(InputError, match=r"on a disk with room; got File too large after \d+ records") as refused:
            record(cable[1], target, start=says(90))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    kept = len(decode((tmp_path / "log-part.bpr").read_bytes()).frames)
    assert kept > 10
    assert f"after {kept} records, which are in log-part.bpr" in str(refused.value)
    assert target.read_bytes() == b"of yesterday"
    assert names(tmp_path) == ["log-part.bpr", "log.bpr"]


def test_a_silent_board_is_told_and_the_last_recording_stays(cable, tmp_path, monkeypatch):
    monkeypatch.setattr(recording, "SILENCE_S", 0.3)
    target = tmp_path / "log.bpr"
    target.write_bytes(b"of yesterday")
    with pytest.raises(PortError, match="silence"):
        record(cable[1], target)
    assert target.read_bytes() == b"of yesterday"
    assert names(tmp_path) == ["log.bpr"]


@pytest.mark.parametrize("place", ["none/log.bpr", "file/log.bpr", "folder"])
def test_what_cannot_be_written_is_said_before_the_board_is_asked(cable, tmp_path, place):
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match="output file"):
        record(cable[1], tmp_path / place, frames=1)
    with pytest.raises(InputError, match="output file"):
        pull(cable[1], tmp_path / place)
    assert names(tmp_path) == ["file", "folder"]


def test_a_pull_that_fails_on_the_way_leaves_the_last_one(cable, tmp_path, monkeypatch):
    def half(words, **_):
        Path(words[-1]).write_bytes(b"half")
        return subprocess.CompletedProcess(words, 1, "", "mpremote: device disconnected")

    monkeypatch.setattr(subprocess, "run", half)
    target = tmp_path / "run.bpr"
    target.write_bytes(b"whole")
    with pytest.raises(PortError, match="disconnected"):
        pull(cable[1], target)
    assert target.read_bytes() == b"whole"
    assert names(tmp_path) == ["run.bpr"]


def test_records_become_a_table_where_one_is_asked_for(tmp_path, monkeypatch, capsys):
    """No raw records under the name of a table."""
    write_log(Log(record_truth(Recipe({}, rows=40, form="demodulated", seed=1)), tmp_path, ""), tmp_path / "turned.csv")
    said, asked = records(tmp_path)(header_text(HEADER)), []

    def recorded(port, target, *_):
        asked.append(target)
        target.write_bytes(said)
        return 5

    monkeypatch.setattr(board, "record_board", recorded)
    for name in ("log.csv", "log.parquet", "log.bpr"):
        assert run(["record", "--port", "P", "-o", str(tmp_path / name)]) == 0
    assert set(asked) == {tmp_path / "log.bpr"}
    assert read_log(tmp_path / "log.csv").n == read_log(tmp_path / "log.bpr").n > 0
    for command, name in (("record", "log.txt"), ("pull", "run.csv")):
        assert run([command, "--port", "P", "-o", str(tmp_path / name)]) == 2
        assert "must be a file that ends in .bpr" in capsys.readouterr().err


def test_a_port_that_is_not_there_is_told_with_what_helps(capsys):
    assert run(["record", "--port", "/dev/nothing", "-o", "a.bpr"]) == 2
    assert "`barberpole doctor` lists boards, `barberpole twin` emulates one" in capsys.readouterr().err
