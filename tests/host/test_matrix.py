"""`make matrix`: a Python is found only if it runs, and what does not compile is noticed."""

import sys

import matrix
import pytest


def test_the_python_that_runs_this_is_among_them():
    version = "{}.{}".format(*sys.version_info[:2])
    assert version in matrix.VERSIONS
    assert matrix.interpreter(version) == sys.executable


def test_a_python_that_does_not_run_is_not_here(tmp_path, monkeypatch):
    shim = tmp_path / "python3.99"
    shim.write_text("#!/bin/sh\nexit 127\n")
    shim.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("PYENV_ROOT", str(tmp_path))
    assert matrix.interpreter("3.99") == ""


@pytest.mark.parametrize(("text", "good"), [("x = 1", True), ("x = ", False), ("x = '\\d'", False)])
def test_what_does_not_compile_is_noticed(tmp_path, monkeypatch, text, good):
    (tmp_path / "a.py").write_text(text)
    monkeypatch.setattr(matrix, "FOLDERS", (str(tmp_path),))
    assert matrix.compiles(sys.executable) is good


def test_the_quick_tests_are_there():
    assert [path for path in matrix.QUICK if not (matrix.REPOSITORY / path).exists()] == []
