"""What verify holds against a calibration, and what it refuses to judge."""

from dataclasses import replace

import numpy as np
import pytest
from barberpole.calibration import Calibration, Residual, SelfcalReference, Validity, Value
from barberpole.errors import InputError
from barberpole.fitted import from_calibration
from barberpole.log import read_log
from barberpole.modelfile import ModelFile
from barberpole.records import HEADER, POINT, POINTS, RESULT, RUN, encode, encode_json
from barberpole.verify import verify

SCALE = 6000.0
COIL_UT_PER_MA = 21.7
FACTORY_MA = 3.65
FACTORY_UT = COIL_UT_PER_MA * FACTORY_MA


@pytest.fixture
def calibration():
    """One gain, no bias, and coils that were driven with 3.65 mA a unit at the factory."""
    values = {f"scale.{axis}": Value(SCALE, 1.0, "LSB/uT") for axis in "xyz"}
    values |= {f"sensitivity_temperature.{axis}_1": Value(-6e-4, 1e-6, "1/K") for axis in "xyz"}
    return Calibration(
        model=ModelFile(("sensitivity_temperature", "scale")),
        parameters=values,
        covariance=np.zeros((len(values), len(values))),
        residual=Residual(100, 20.0, rms_ut=0.003, noise_lsb=20.0),
        log_name="made up",
        log_sha256="0" * 64,
        validity=Validity(b_max_ut=50.0),
        selfcal=SelfcalReference(
            gain_ut_per_unit=((FACTORY_UT, 0.0, 0.0), (0.0, FACTORY_UT, 0.0), (0.0, 0.0, FACTORY_UT)),
            units_ma=(FACTORY_MA, FACTORY_MA, FACTORY_MA),
            trajectory="0123456789ab",
            offset_lsb=(0.0, 0.0, 0.0),
            temp_c=25.0,
        ),
    )


def coil_run(path, calibration, unit_ma):
    """A board's record of a run with this current a unit, its gains as the factory left them."""
    unit = np.vstack([np.eye(3), -np.eye(3), 0.5 * np.eye(3), -0.5 * np.eye(3)])
    reading = SCALE * (COIL_UT_PER_MA * unit_ma * unit + 10.0)
    frames = [encode_json(HEADER, 0, {"format": 1, "calibration": calibration.hash})]
    frames.append(encode_json(RUN, 1, {"unit_ma": [unit_ma] * 3, "trajectory": "0123456789ab", "block": 0}))
    for k, (u, y) in enumerate(zip(unit, reading, strict=True)):
        frames.append(encode(POINTS, 2 + k, POINT.pack(k, *u, *y, *-y, *(unit_ma * u), 25.0)))
    frames.append(encode_json(RESULT, 2 + len(unit), {"accepted": True, "reasons": [], "gain": [1.0] * 3}))
    path.write_bytes(b"".join(frames))
    return read_log(path)


@pytest.mark.parametrize("unit_ma", [FACTORY_MA, 2.0])
def test_gains_do_not_hang_on_the_current_of_a_unit(tmp_path, calibration, unit_ma):
    found = verify(coil_run(tmp_path / "run.bpr", calibration, unit_ma), calibration)
    assert found.to_json()["gain"] == pytest.approx([1.0] * 3, rel=1e-6)
    assert found.passed, found.to_json()


def written(path, names, rows):
    np.savetxt(path, rows, "%.9g", ",", header=names, comments="")
    return read_log(path)


def test_a_column_that_the_model_needs_is_named(tmp_path, calibration):
    b = np.random.default_rng(1).normal(0, 30.0, (40, 3))
    log = written(tmp_path / "a.csv", "x_lsb,y_lsb,z_lsb,bx_ut,by_ut,bz_ut", np.hstack([SCALE * b, b]))
    with pytest.raises(InputError, match="temp_c"):
        verify(log, calibration)


def test_nothing_to_check_is_no_pass(tmp_path, calibration):
    names = "x_lsb,y_lsb,z_lsb,temp_c,ix_ma,iy_ma,iz_ma"
    log = written(tmp_path / "a.csv", names, np.random.default_rng(1).normal(0, 3.0, (40, 7)))
    with pytest.raises(InputError, match="the log must be"):
        verify(log, calibration)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"easy_axis": (1, 7, 1)}, "easy_axis"),
        ({"parameters": {"scale.x": Value(float("nan"), 1.0, "LSB/uT")}}, r"scale\.x"),
        ({"selfcal": {"units_ma": (3.0, 0.0, 3.0)}}, "units_ma"),
        ({"selfcal": {"gain_ut_per_unit": ((float("inf"), 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))}}, "gain_ut"),
        ({"selfcal": {"gain_ut_per_unit": ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))}}, "gain_ut"),
    ],
)
def test_a_calibration_edited_by_hand_is_refused(calibration, change, says):
    if "parameters" in change:
        change = {"parameters": calibration.parameters | change["parameters"]}
    if "selfcal" in change:
        change = {"selfcal": replace(calibration.selfcal, **change["selfcal"])}
    with pytest.raises(InputError, match=says):
        from_calibration(replace(calibration, **change))
