"""barberpole doctor: what a machine lacks is named, and only what is needed makes it fail."""

import json
from importlib import metadata

import pytest
from barberpole import doctor
from barberpole.cli import run


def test_this_machine_has_what_is_needed(capsys):
    assert run(["doctor", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["ok"]
    found = {finding["what"]: finding for finding in said["findings"]}
    assert found["board files"]["found"].split(", ")[0]
    assert "pybv11" in found["board files"]["found"]
    assert found["mpy-cross runs"]["ok"]
    assert any(what.startswith("numpy") and finding["needed"] for what, finding in found.items())


def test_a_missing_package_is_named(monkeypatch, capsys):
    asked = metadata.version

    def without_scipy(name):
        if name == "scipy":
            raise metadata.PackageNotFoundError(name)
        return asked(name)

    monkeypatch.setattr(doctor.metadata, "version", without_scipy)
    assert run(["doctor"]) == 1
    said = capsys.readouterr().out
    assert "missing: scipy>=" in said
    assert "python -m pip install 'scipy>=" in said


def test_a_missing_extra_only_says_what_it_is_for(monkeypatch, capsys):
    asked = ["nothing-like-it>=1; extra == 'twin'", "numpy>=1; extra == 'fleet'"]
    monkeypatch.setattr(doctor.metadata, "requires", lambda _: asked)
    assert run(["doctor"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "extra fleet ok installed" in said
    (part,) = [finding for finding in doctor.by_extra(doctor.examine()) if finding.what == "extra twin"]
    assert (part.ok, part.needed, part.found) == (False, False, "without nothing-like-it>=1")
    assert "need an emulated board: python -m pip install 'nothing-like-it>=1'" in said


def test_a_tool_that_does_not_run_is_not_said_to_be_here(monkeypatch, tmp_path):
    broken = tmp_path / "micropython"
    broken.write_text("#!/bin/sh\nexit 3\n")
    broken.chmod(0o755)
    monkeypatch.setattr("barberpole.twin.interpreter.find_micropython", lambda: str(broken))
    (found,) = [finding for finding in doctor.examine() if finding.what == "micropython runs"]
    assert (found.ok, found.needed, found.found) == (False, False, "no answer")


def test_without_its_own_metadata_it_says_that(monkeypatch, capsys):
    def unknown(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(doctor.metadata, "metadata", unknown)
    monkeypatch.setattr(doctor.metadata, "requires", unknown)
    assert run(["doctor"]) == 1
    assert "missing: barberpole" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("have", "wanted", "enough"),
    [("1.26.4", "numpy>=1.26", True), ("1.9", "numpy>=1.26", False), ("2.0rc1", "x>=1.99", True), ("1", "x", True)],
)
def test_versions_are_compared_by_their_numbers(have, wanted, enough):
    assert doctor._at_least(have, wanted) is enough
