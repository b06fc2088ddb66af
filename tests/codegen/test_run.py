"""The generated compensation against the exact forward model: in MicroPython, and with every operation in float32."""

import json

import numpy as np
import pytest
from barberpole.fitted import from_calibration
from barberpole.selfcal import split
from barberpole_codegen.coverage import conditions
from barberpole_codegen.functions import COILS, READINGS
from barberpole_codegen.narrow import LIMIT

TEMPS_C = (0.0, 50.0)


@pytest.fixture(scope="module")
def fitted(calibration):
    return from_calibration(calibration)


def readings(fitted, model, tried, coil_ut):
    """Inputs of the generated functions, by the model's own forward direction in double."""
    given = {"t": tried.temp_c} | dict(zip(("gx", "gy", "gz"), tried.gain, strict=True))
    for state, suffix in ((1.0, "s"), (-1.0, "r")):
        at = fitted.conditions(state=state, temp_c=tried.temp_c, coil_ut=coil_ut, gain=tuple(tried.gain))
        xyz = tried.field_ut
        for term in model.terms:
            xyz = term.effect.forward(xyz, fitted.p[term.at], at)
        given |= {f"{axis}{suffix}": np.asarray(v) for axis, v in zip("xyz", xyz, strict=True)}
    return given


@pytest.fixture(scope="module", params=["undo", "undo_coil"])
def case(request, fitted, board):
    """Name of the function, its arguments (k, n), and what must come out (outputs, n)."""
    coil = 80.0 if request.param == "undo_coil" else 0.0
    tried = conditions(board.sensor.range_ut, board, TEMPS_C, coil)
    if request.param == "undo":
        given = readings(fitted, fitted.model, tried, np.zeros((3, 1)))
        return request.param, np.array([given[name] for name in READINGS]), tried.field_ut
    _, inner = split(fitted.model)
    given = readings(fitted, inner, tried, tried.coil_ut) | dict(zip(COILS, tried.coil_ut, strict=True))
    own = tried.field_ut + tried.coil_ut
    return request.param, np.array([given[name] for name in READINGS + COILS]), np.concatenate([own, own])


def test_in_micropython(case, generated, micropython, board, tmp_path):
    name, arguments, wanted = case
    (tmp_path / "bp_calibration.py").write_text(generated.texts["bp_calibration.py"])
    (tmp_path / "arguments.json").write_text(json.dumps(arguments[:, :300].T.tolist()))
    script = f"""
import json
from bp_calibration import {name} as f
print(json.dumps([f(*row) for row in json.loads(open("arguments.json").read())]))
"""
    found = np.array(json.loads(micropython(script, tmp_path))).T
    error = np.max(np.abs(found - wanted[:, :300])) / board.sensor.range_ut
    assert error < LIMIT / 100  # constants rounded to float32, operations in double


def test_in_float32(case, generated, board):
    """The emitted text itself, on numpy's float32: Python's own numbers give way to it, so each operation rounds."""
    name, arguments, wanted = case
    namespace: dict = {"sqrt": np.sqrt}
    exec(generated.texts["bp_calibration.py"].replace("from math import sqrt", ""), namespace)
    found = np.array(namespace[name](*arguments.astype(np.float32)))
    assert found.dtype == np.float32
    error = np.max(np.abs(found - wanted)) / board.sensor.range_ut
    assert error < LIMIT / 10
    stated = generated.precision[name]
    assert stated.range_ut == board.sensor.range_ut
    assert error < 2 * stated.fraction  # the bound in the build, found at other conditions


def test_in_frame_undoes_the_tilt(fitted, generated):
    namespace: dict = {}
    exec(generated.texts["bp_calibration.py"], namespace)
    outer, _ = split(fitted.model)
    field = np.array([[20.0], [-5.0], [40.0]])
    tilted = outer.predict(field, fitted.p, fitted.conditions(state=1.0))
    np.testing.assert_allclose(namespace["in_frame"](*tilted[:, 0]), field[:, 0], rtol=1e-6)
