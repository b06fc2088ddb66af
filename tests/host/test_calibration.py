"""Calibration files: every number comes back exactly, and a wrong file is refused in one sentence."""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from barberpole.calibration import (
    Calibration,
    Residual,
    SelfcalReference,
    Step,
    Validity,
    Value,
    calibration_text,
    read_calibration,
    write_calibration,
)
from barberpole.errors import InputError
from barberpole.modelfile import ModelFile
from hypothesis import given, settings
from hypothesis import strategies as st

REAL = st.floats(allow_nan=False)
ANY = st.floats()


def example(values: tuple[float, ...] = (0.1 + 0.2, -1 / 3)) -> Calibration:
    parameters = {f"bias.{chr(97 + i)}": Value(v, abs(v), "µT") for i, v in enumerate(values)}
    response = ((80.0, 0.1, 0.0), (0.0, 80.1, 0.0), (0.0, 0.0, 79.9))
    selfcal = SelfcalReference(response, (3.69, 3.69, 3.69), "ab12", (1.0, 2.0, 3.0), 24.5)
    return Calibration(
        model=ModelFile(("bias", "scale"), {"scale": {"shared": True}}, {"temp_c": 25.0}, sensor="hmc1021_1022"),
        parameters=parameters,
        covariance=np.outer(values, values),
        residual=Residual(100, 2.0, rms_ut=0.1, noise_lsb=float("nan")),
        log_name="rotation.csv",
        log_sha256="00ff",
        unobservable=("scale.z",),
        validity=Validity((-50.0, -50.0, -50.0), (50.0, 50.0, 50.0), 60.0, 10.0, 40.0),
        history=(Step(3.0, 3.1, added="bias"), Step(2.0, 2.1, removed="lag")),
        selfcal=selfcal,
    )


def test_round_trip(tmp_path):
    path = tmp_path / "cal.toml"
    write_calibration(example(), path)
    back = read_calibration(path)
    assert back.path == path
    assert calibration_text(back, path) == path.read_text()
    assert back.hash == example().hash
    assert (back.model, back.parameters, back.history) == (example().model, example().parameters, example().history)
    assert (back.validity, back.selfcal, back.unobservable) == (example().validity, example().selfcal, ("scale.z",))
    assert np.isnan(back.residual.noise_lsb or 0.0)


@settings(max_examples=40)
@given(st.lists(REAL, max_size=5))
def test_numbers_come_back_exactly(values):
    with tempfile.TemporaryDirectory() as folder, np.errstate(over="ignore", invalid="ignore"):
        path = Path(folder) / "cal.toml"
        write_calibration(example(tuple(values)), path)
        back = read_calibration(path)
        assert [v.value for v in back.parameters.values()] == values
        assert np.array_equal(back.covariance, np.outer(values, values), equal_nan=True)


@given(ANY)
def test_numpy_numbers_are_written_as_numbers(value):
    cal = replace(example(), t0_c=np.float64(value))
    assert "np.float64" not in calibration_text(cal, Path("cal.toml"))


def test_hash_follows_the_numbers():
    cal = example()
    assert example((0.3, 0.2)).hash != example((0.3, np.nextafter(0.2, 1))).hash
    assert replace(cal, log_name="other.csv").hash == cal.hash
    assert replace(cal, selfcal=None).hash != cal.hash


def test_plugins_are_named_beside_the_file(tmp_path):
    model = ModelFile(("bias", "iron"), plugins=(str(tmp_path / "iron.py"),))
    path = tmp_path / "cal.toml"
    write_calibration(replace(example(), model=model), path)
    assert 'plugins = ["iron.py"]' in path.read_text()
    assert read_calibration(path).model.plugins == (str(tmp_path / "iron.py"),)
    assert read_calibration(path).model.hash == model.hash


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("format = 1", "format = 2", "format 1"),
        ("rms_lsb = 2.0", 'rms_lsb = "2"', "residual.rms_lsb"),
        ("rms_lsb = 2.0", "rms_nt = 2.0", "closest: residual.rms_"),
        ("temp_max_c", "temp_max_f", "closest: validity.temp_max_c"),
        ('b = {value = -0.3333333333333333, stderr = 0.3333333333333333, unit = "µT"}', "", "1 rows of 1"),
        ('unit = "µT"}', "unit = 3}", "parameters.bias.a.unit"),
        ("[residual]", "[residuals]", "closest: residual"),
    ],
)
def test_refusals(tmp_path, old, new, says):
    path = tmp_path / "cal.toml"
    text = calibration_text(example(), path)
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError) as caught:
        read_calibration(path)
    assert says in str(caught.value)
    assert str(path) in str(caught.value)
