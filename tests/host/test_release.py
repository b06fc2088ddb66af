"""The wheel alone, in an empty environment: `make release-check`. It installs everything afresh, by the lock file."""

import json
import os
import subprocess
import sys
import tarfile
from pathlib import Path

import numpy as np
import pytest
from barberpole.challenge.record import Recipe, record, write

pytestmark = pytest.mark.release
REPOSITORY = Path(__file__).parents[2]


def call(*words, cwd, ok=0):
    """Run a program without the repository in reach."""
    env = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run([str(w) for w in words], cwd=cwd, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == ok, f"{words}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    return done.stdout


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with the wheel, the sdist and an environment that holds the wheel with its twin extra."""
    folder = tmp_path_factory.mktemp("release")
    pip = (sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", folder, REPOSITORY)
    call(*pip, cwd=folder)
    call(sys.executable, "-m", "venv", folder / "venv", cwd=folder)
    install = (folder / "venv" / "bin" / "python", "-m", "pip", "install", "-q", "--disable-pip-version-check")
    call(*install, "--require-hashes", "-r", _needed(folder), cwd=folder)
    (wheel,) = folder.glob("*.whl")
    call(*install, "--no-deps", wheel, cwd=folder)
    return folder


def _needed(folder):
    """The lock file without what only the tests and fleets need."""
    without = ("pytest", "hypothesis", "ruff", "pyright", "sympy", "playwright", "dask", "distributed", "nodejs")
    parts = (REPOSITORY / "host" / "requirements.lock").read_text().replace("\\\n", "\\\0").splitlines()
    kept = [part.replace("\\\0", "\\\n") for part in parts if not part.startswith(without)]
    (folder / "lock.txt").write_text("\n".join(kept) + "\n")
    return folder / "lock.txt"


def command(place, *words, ok=0):
    return call(place / "venv" / "bin" / "barberpole", *words, cwd=place, ok=ok)


def test_version_is_that_of_the_project(place):
    said = command(place, "--version").strip()
    assert f'version = "{said}"' in (REPOSITORY / "pyproject.toml").read_text()
    assert f"## {said}" in (REPOSITORY / "CHANGELOG.md").read_text()


def test_a_fit_on_a_csv(place):
    write(record(Recipe({}, rows=600, form="demodulated", seed=2)), place / "log.csv")
    found = json.loads(command(place, "fit", "log.csv", "--model", "bias,scale,misalignment", "--json"))
    assert found["converged"]
    assert np.isclose(found["rms_lsb"], 2.0, rtol=0.2)


def test_the_demo(place):
    last = json.loads(command(place, "demo", "--json").strip().splitlines()[-1])
    assert last["named"] == last["hidden"]
    assert last["rms_after_lsb"] < 0.1 * last["rms_before_lsb"]


def test_nothing_of_the_repository_is_used(place):
    said = call(place / "venv" / "bin" / "python", "-c", "import barberpole; print(barberpole.__file__)", cwd=place)
    assert str(place) in said


def test_the_source_archive_is_the_repository(place):
    """Every file that is under version control, and nothing else but the archive's own description."""
    build = "import hatchling.build as b; print(b.build_sdist('.'))"
    env = place / "builder"
    call(sys.executable, "-m", "venv", env, cwd=place)
    call(env / "bin" / "python", "-m", "pip", "install", "-q", "hatchling", cwd=place)
    copy = place / "copy"
    call("git", "clone", "-q", "--depth", "1", REPOSITORY.as_uri(), copy, cwd=place)
    name = call(env / "bin" / "python", "-c", build, cwd=copy).strip().splitlines()[-1]
    with tarfile.open(copy / name) as archive:
        inside = {member.name.partition("/")[2] for member in archive if member.isfile()}
    tracked = set(call("git", "ls-files", cwd=copy).splitlines())
    assert tracked - inside == set()
    assert inside - tracked == {"PKG-INFO"}
