"""Constants and operations in float32, and the refusal of what they cannot carry."""

import numpy as np
import pytest
from barberpole.errors import InputError, LimitError
from barberpole_codegen.narrow import Precision, evaluate, narrow, narrow_number, precision, require
from barberpole_codegen.trace import trace


@pytest.mark.parametrize("value", [0.1, -1 / 3, 6151.6458, 1e-30, 0.0, 3e38])
def test_numbers_become_the_nearest_float32(value):
    assert narrow_number(value) == float(np.float32(value))


@pytest.mark.parametrize("value", [1e39, -1e40, 1e-40, np.inf, np.nan])
def test_numbers_that_float32_cannot_hold_are_refused(value):
    with pytest.raises(InputError, match="coefficient"):
        narrow_number(value)


def test_every_operation_is_rounded():
    x = np.float32(1.0) + np.arange(100, dtype=np.float32) / np.float32(977)
    done = evaluate(narrow(trace(lambda x: ((x * 1.1 + 0.3) / 3.0 - np.sqrt(x),), ("x",))), {"x": x})[0]
    step_by_step = np.array([(v * np.float32(1.1) + np.float32(0.3)) / np.float32(3.0) - np.sqrt(v) for v in x])
    assert step_by_step.dtype == done.dtype == np.float32
    np.testing.assert_array_equal(done, step_by_step)


def test_cancellation_is_measured_and_refused():
    x = np.linspace(-100.0, 100.0, 1001)
    program = trace(lambda x: ((x + 1e6) - 1e6,), ("x",))
    found = precision(program, {"x": x}, x[None], 100.0)
    assert found.inverse_ut < 1e-9
    assert 0.02 < found.error_ut < 0.04  # half a step of float32 at 1e6
    with pytest.raises(LimitError, match=r"within 0.0001 of full scale .* got 0.00025"):
        require(found, "the compensation")


def test_a_result_that_is_no_number_is_refused():
    x = np.linspace(0.0, 2.0, 11)
    found = precision(trace(lambda x: (np.sqrt(1.0 - x),), ("x",)), {"x": x}, np.zeros((1, 11)), 1.0)
    assert found.error_ut == np.inf
    with pytest.raises(LimitError):
        require(found, "the compensation")
    with pytest.raises(LimitError):
        require(Precision(1.0, np.nan, 0.0), "the compensation")
