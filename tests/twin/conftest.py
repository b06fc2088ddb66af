"""Boards for the tests: started on demand, stopped afterwards."""

import contextlib
import subprocess
import sys
import time
from pathlib import Path

import pytest
from barberpole.board import load_board
from barberpole.calibrating import calibration_of, with_selfcal
from barberpole.demo.bench import TRUE_EFFECTS, Bench
from barberpole.fit.fit import fit_observations
from barberpole.modelfile import ModelFile
from barberpole.nominal import nominal
from barberpole.observations import observations
from barberpole.twin import Twin

PROGRAMS = Path(__file__).with_name("programs")


@pytest.fixture(scope="session")
def board():
    return load_board("pybv11")


@pytest.fixture(scope="session")
def calibrated(tmp_path_factory):
    """A bench, and a calibration from a log of known fields on it, with the factory's coil run as reference."""
    bench = Bench(load_board("pybv11"), tmp_path_factory.mktemp("bench"), seed=7, say=lambda _: None)
    with bench.on(bench.station(150)) as twin:
        bench.deploy(twin, nominal(bench.board), "factory")
        session = bench.power_up(twin, "factory", 750)
    model = ModelFile(("bias", "scale", *TRUE_EFFECTS))
    fit = fit_observations(observations(session.log, bench.board.sensor), model)
    made = calibration_of(fit, session.log, model)
    return bench, with_selfcal(made, session.run.selfcal, bench.board.sensor)


@pytest.fixture
def start(board, tmp_path):
    """start(program, **what Twin takes): a board whose main.py is programs/<program>."""
    with contextlib.ExitStack() as stack:

        def begin(program=None, **options):
            files = {"/adc.py": PROGRAMS / "adc.py"}
            if program:
                files["/main.py"] = PROGRAMS / program
            options = {"flash_dir": tmp_path / "flash", "files": files} | options
            return stack.enter_context(Twin(board, **options))

        yield begin


@pytest.fixture(scope="session")
def mpremote():
    """mpremote(twin, *arguments): its output; fails where mpremote does."""

    def run(twin, *arguments):
        command = [sys.executable, "-m", "mpremote", "connect", twin.port, *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout.replace("\r\n", "\n")

    return run


@pytest.fixture(scope="session")
def said():
    """said(twin, text): all output once the board has said `text` (`count` times)."""

    def wait(twin, text, count=1, timeout_s=20.0):
        until = time.monotonic() + timeout_s
        while (log := twin.log_text).count(text) < count:
            assert time.monotonic() < until, log[-2000:]
            time.sleep(0.01)
        return log

    return wait
