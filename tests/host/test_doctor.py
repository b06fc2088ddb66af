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
    assert "missing: scipy>=" in capsys.readouterr().out


def test_a_missing_extra_only_says_what_it_is_for(monkeypatch, capsys):
    monkeypatch.setattr(doctor.metadata, "requires", lambda _: ["nothing-like-it>=1; extra == 'twin'"])
    assert run(["doctor"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "nothing-like-it>=1 not here not installed the emulated board" in said


@pytest.mark.parametrize(
    ("have", "wanted", "enough"),
    [("1.26.4", "numpy>=1.26", True), ("1.9", "numpy>=1.26", False), ("2.0rc1", "x>=1.99", True), ("1", "x", True)],
)
def test_versions_are_compared_by_their_numbers(have, wanted, enough):
    assert doctor._at_least(have, wanted) is enough
