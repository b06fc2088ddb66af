"""The small things everything else stands on: files, messages, units, folders, written pages, make's targets."""

import os
import re
import tomllib
from pathlib import Path

import pytest
from barberpole import paths, units
from barberpole.docs import board_reference
from barberpole.doctor import SERVES
from barberpole.errors import BarberpoleError, InputError, LimitError, PortError, must
from barberpole.files import read_text, write_atomic

REPOSITORY = Path(__file__).parents[2]


def test_write_replaces_the_whole_file(tmp_path):
    path = tmp_path / "a.txt"
    write_atomic(path, "a longer text that was there before")
    write_atomic(path, "µ")
    write_atomic(tmp_path / "b.bin", b"\xff")
    assert path.read_bytes() == "µ".encode()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.txt", "b.bin"]


def test_a_write_that_fails_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "a.txt"
    path.write_text("old")

    def full(*_args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(InputError, match="No space left"):
        write_atomic(path, "new")
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]
    assert path.read_text() == "old"


def test_unreadable_files_are_named(tmp_path):
    with pytest.raises(InputError, match=r"the page must be a file that can be read; got No such file"):
        read_text(tmp_path / "none", "the page")
    (tmp_path / "latin").write_bytes(b"\xb5T")
    with pytest.raises(InputError, match="UTF-8 text; got byte 0xb5"):
        read_text(tmp_path / "latin", "the page")


def test_every_error_is_one_of_ours():
    assert all(issubclass(kind, BarberpoleError) for kind in (InputError, LimitError, PortError))
    assert must("x", "1", 2) == "x must be 1; got 2"
    assert must("x", "1", 2, "a.toml") == "x must be 1; got 2 (a.toml)"


def test_units_two_ways():
    # the Earth's field, about half a gauss, is about 50 000 nT
    assert units.ut_to_nt(units.gauss_to_ut(0.5)) == pytest.approx(50_000.0)


def test_folders_are_found():
    assert (paths.boards() / "pybv11.toml").is_file()
    assert paths.firmware().is_dir()


def test_packaged_folders_come_first(tmp_path, monkeypatch):
    (tmp_path / "_boards").mkdir()
    monkeypatch.setattr(paths, "_PACKAGE", tmp_path)
    assert paths.boards() == tmp_path / "_boards"


def test_board_reference_is_up_to_date():
    written = (REPOSITORY / "host" / "docs" / "boards.md").read_text()
    assert written == board_reference(), "run `make docs`"
    assert "| `pulse_us` | µs | Width of one pulse. |" in written


def test_every_target_of_make_does_something():
    rules = (REPOSITORY / "Makefile").read_text()
    targets = re.search(r"^\.PHONY: (.+)$", rules, re.M).group(1).split()
    assert {"demo", "test", "bench", "soak", "fuzz"} < set(targets)
    for target in targets:
        assert re.search(rf"^{target}:.*\n\t\S", rules, re.M), target


def test_doctor_knows_what_every_optional_part_is_for():
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    assert set(SERVES) == set(project["optional-dependencies"])
