"""A build's folder through bad moments: killed or interrupted before each step, two at once, links, odd places."""

import os
import signal
import sys
from multiprocessing import get_context

import pytest
from barberpole.built import recover
from barberpole.errors import InputError
from barberpole_codegen import folder as folders
from barberpole_codegen.folder import require_replaceable, write_folder

FORMER = {"build.json": b"former", "mpy/bp_main.mpy": b"1" * 4000}
LATER = {"build.json": b"later", "mpy/bp_main.mpy": b"2" * 5000, "src/main.py": b"2"}
NEXT = {"build.json": b"next"}
STEPS = ("open", "os.mkdir", "os.rename", "os.remove", "os.rmdir", "os.scandir", "shutil.rmtree")


def contents(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def interrupted(folder, step, how):
    """Build in a child that is stopped before its step-th call that touches files; whether it came so far."""
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) != 0
    seen = 0

    def hook(event, _args):
        nonlocal seen
        if event not in STEPS:
            return
        seen += 1
        if how == "kill" and seen == step:
            os.kill(os.getpid(), signal.SIGKILL)
        if (how == "Ctrl-C" and seen == step) or (how == "Ctrl-C held" and seen >= step):
            raise KeyboardInterrupt

    code = 1
    try:
        sys.addaudithook(hook)
        write_folder(folder, LATER)
        code = 0
    finally:  # by Ctrl-C too: the child is no second test run
        os._exit(code)


@pytest.mark.parametrize("how", ["kill", "Ctrl-C", "Ctrl-C held"])
def test_stopped_before_any_step_a_whole_build_is_there_or_comes_back(tmp_path, monkeypatch, how):
    monkeypatch.setattr(folders, "STALE_S", -1.0)
    folder = tmp_path / "my [build]"
    aside = step = 0
    while step := step + 1:
        write_folder(folder, FORMER)
        if not interrupted(folder, step, how):
            break
        aside += not folder.exists()
        assert how != "Ctrl-C" or folder.exists()
        require_replaceable(folder)
        assert contents(folder) in (FORMER, LATER), step
        write_folder(folder, NEXT)
        assert contents(folder) == NEXT
        assert [path.name for path in tmp_path.iterdir()] == [folder.name]
    assert contents(folder) == LATER
    assert step > 15
    assert aside == (0 if how == "Ctrl-C" else 1), "the step between the two renames was not met"


def test_two_builds_at_once_leave_one_of_the_two(tmp_path):
    folder = tmp_path / "out"

    def often(content):
        for _ in range(40):
            write_folder(folder, content)

    builders = [get_context("fork").Process(target=often, args=(content,)) for content in (FORMER, LATER)]
    for builder in builders:
        builder.start()
    for builder in builders:
        builder.join(30)
    assert [builder.exitcode for builder in builders] == [0, 0]
    assert contents(folder) in (FORMER, LATER)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_the_last_of_former_builds_comes_back(tmp_path):
    for name, age in (("out.old-1", 100), ("out.old-2", 50), ("outer.old-3", 0)):
        (tmp_path / name).mkdir()
        os.utime(tmp_path / name, (1e9 - age, 1e9 - age))
    recover(tmp_path / "out")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "out.old-1", "outer.old-3"]


def test_a_linked_folder_stays_linked(tmp_path):
    (tmp_path / "far").mkdir()
    (tmp_path / "near").symlink_to("far")
    write_folder(tmp_path / "near", LATER)
    assert (tmp_path / "near").is_symlink()
    assert contents(tmp_path / "far") == LATER


@pytest.mark.parametrize("where", [".", "..", "/", ""])
def test_the_folder_one_stands_in_is_not_replaced(tmp_path, monkeypatch, where):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="a folder of its own"):
        require_replaceable(folders.Path(where))
