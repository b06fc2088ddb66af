"""Files are whole or not there: two writers, Ctrl-C at any moment, a full disk; and code runs only when named."""

import errno
import multiprocessing
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from barberpole import files
from barberpole.cli import run
from barberpole.errors import InputError
from barberpole.files import write_atomic

REPOSITORY = Path(__file__).parents[2]
TEXTS = ("a" * 300_000, "b" * 500_000)


def _write_often(path, text):
    for _ in range(60):
        write_atomic(path, text)


def test_two_processes_on_one_file_leave_one_of_the_two(tmp_path):
    path = tmp_path / "calibration.toml"
    write_atomic(path, TEXTS[0])
    writers = [multiprocessing.get_context("fork").Process(target=_write_often, args=(path, t)) for t in TEXTS]
    for writer in writers:
        writer.start()
    while any(writer.is_alive() for writer in writers):
        assert path.read_text() in TEXTS
    assert [writer.exitcode for writer in writers] == [0, 0]
    assert [p.name for p in tmp_path.iterdir()] == ["calibration.toml"]


def test_ctrl_c_at_any_moment_leaves_a_whole_file(tmp_path):
    """A process that writes without end is interrupted at six moments."""
    path = tmp_path / "out.toml"
    program = (
        "import sys; from barberpole.files import write_atomic\nprint('on', flush=True)\n"
        "while True: write_atomic(sys.argv[1], 'x' * 2_000_000)"
    )
    for delay in range(6):
        child = subprocess.Popen(
            [sys.executable, "-c", program, str(path)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
        assert child.stdout is not None
        child.stdout.readline()
        time.sleep(0.004 * delay)
        child.send_signal(signal.SIGINT)
        child.wait(20)
        child.stdout.close()
        assert not path.exists() or path.stat().st_size == 2_000_000
        assert [p.name for p in tmp_path.iterdir() if p != path] == []


def test_a_full_disk_says_so_and_keeps_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "a.toml"
    write_atomic(path, "old")

    def full(self, data):
        with self.open("wb") as file:
            file.write(data[:2])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(files.Path, "write_bytes", full)
    with pytest.raises(InputError, match=r"on a disk with room; got No space left on device"):
        write_atomic(path, "new text")
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.toml"]


def test_a_parent_that_is_a_file_is_one_sentence(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="Not a directory"):
        write_atomic(tmp_path / "file" / "out.toml", "x")


def test_code_is_run_in_one_place_only():
    """No eval, no pickle, and exec where a plugin is loaded that a user named."""
    found = set()
    for path in [*(REPOSITORY / "host").rglob("*.py"), *(REPOSITORY / "codegen").rglob("*.py")]:
        if "shims" not in path.parts and re.search(
            r"(?<![\w.])(eval|exec)\(|pickle\.loads?\(|yaml\.load\(", path.read_text()
        ):
            found.add(path.relative_to(REPOSITORY / "host").as_posix())
    assert found == {"barberpole/plugins.py"}


def test_a_plugin_that_runs_is_named_before(tmp_path, capsys):
    assert run(["effect", "new", "mine", "--folder", str(tmp_path)]) in (0, 2)
    plugin = tmp_path / "mine.py"
    if not plugin.exists():
        from barberpole.plugins import new_plugin

        new_plugin("mine", tmp_path)
    log = tmp_path / "log.csv"
    log.write_text("x_lsb,y_lsb,z_lsb\n1,2,3\n")
    model = tmp_path / "model.toml"
    model.write_text('effects = ["bias", "mine"]\nplugins = ["mine.py"]\n')
    capsys.readouterr()
    run(["fit", str(log), "--model", str(model)])
    assert f"runs your own code in {plugin}" in capsys.readouterr().err
    run(["fit", str(log), "--model", str(model)])
    assert "runs your own code" not in capsys.readouterr().err
