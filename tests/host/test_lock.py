"""host/requirements.lock: all that pyproject.toml asks for, pinned, with hashes, and no place to fetch it from."""

import re
import tomllib
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]

LOCKED = ("twin", "fleet", "test")  # the peers of the benchmark are no part of the tool


@pytest.fixture(scope="module")
def pinned():
    """Name -> version and number of hashes."""
    text = (REPOSITORY / "host" / "requirements.lock").read_text().replace("\\\n", " ")
    found = {}
    for line in text.splitlines():
        if line.strip() and not line.startswith("#"):
            name, version = re.match(r"([A-Za-z0-9._-]+)(?:\[[^]]*\])?==([^\s;]+)", line).groups()
            found.setdefault(_normal(name), []).append((version, line.count("--hash=sha256:")))
    return found


def _numbers(version):
    return [int(part) for part in re.findall(r"\d+", version)]


def _normal(name):
    return re.sub(r"[-_.]+", "-", name).lower()


def test_all_that_is_asked_for_is_pinned(pinned):
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    asked = [*project["dependencies"], *(line for extra in LOCKED for line in extras[extra])]
    for line in asked:
        name, least = re.match(r"([\w.-]+)(?:\[\w+\])?>=([\d.]+)$", line).groups()
        versions = [version for version, _ in pinned.get(_normal(name), [])]
        assert versions, f"{name} is not in the lock file: renew it (host/docs/security.md)"
        assert all(_numbers(version) >= _numbers(least) for version in versions), f"{line}: renew the lock file"


def test_every_pin_has_hashes(pinned):
    assert [name for name, pins in pinned.items() if not all(count for _, count in pins)] == []
    assert len(pinned) > 80


def test_no_address_is_in_it():
    text = (REPOSITORY / "host" / "requirements.lock").read_text()
    assert re.findall(r"://|--(?:extra-)?index|--find-links|--trusted-host", text) == []
