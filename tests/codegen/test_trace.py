"""Arithmetic on symbols: the same numbers come out, nothing is done twice, and what cannot be traced is refused."""

import numpy as np
import pytest
from barberpole.effects import Conditions, Setup
from barberpole.errors import InputError
from barberpole.model import compose
from barberpole_codegen.narrow import evaluate
from barberpole_codegen.trace import MUL, Step, trace

RNG = np.random.default_rng(4)
XY = {"x": RNG.uniform(0.5, 2.0, 50), "y": RNG.uniform(0.5, 2.0, 50)}

FUNCTIONS = {
    "operators": lambda x, y: (x + 2 * y - 3, (1 - x) / y, 4 / x, -(y - x), +x, x**2 - y**3),
    "roots": lambda x, y: (np.sqrt(x * x + y * y), np.sqrt(x) / np.float64(3.0)),
    "numpy scalars": lambda x, y: (np.float64(2.5) * x + np.float32(0.5), x / np.int64(4), np.float64(1.0) - y),
    "object arrays": lambda x, y: tuple(np.array([[1.0, 0.2], [0.3, 1.5]]) @ np.array([x, y], dtype=object)),
    "array times symbol": lambda x, y: tuple(np.array([1.0, 2.0]) * x - y),
    "ufuncs": lambda x, y: (np.add(x, y), np.multiply(np.negative(x), 2.0), np.square(y)),
    "zero and one": lambda x, y: (0.0 * x + y * 1.0, x - 0, y / 1, 0 / x + y, x + 0.0),
    "steps numbered like constants": lambda x, y: ((x + y) + 0.5, (x * y) * (x + y), (x * y) + (x + y), x * y - 1.0),
    "minus one": lambda x, y: (x * -1.0, -1 * (x + y), x + -2.0, y - -3.0),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_program_computes_what_the_function_does(name):
    function = FUNCTIONS[name]
    done = evaluate(trace(function, ("x", "y")), XY, np.float64)
    wanted = np.array([function(x, y) for x, y in zip(XY["x"], XY["y"], strict=True)], float).T
    for got, want in zip(done, wanted, strict=True):
        np.testing.assert_allclose(np.broadcast_to(got, want.shape), want, rtol=1e-14)


def test_equal_operations_are_done_once():
    program = trace(lambda x, y: ((x + y) * (y + x), (x + y) * (x + y)), ("x", "y"))
    assert len(program.steps) == 2


def test_unused_operations_are_left_out():
    def wasteful(x, y):
        _ = x * y + 7
        return (x,)

    assert trace(wasteful, ("x", "y")).steps == ()


def test_neutral_elements_leave_no_trace():
    program = trace(lambda x: (x * 1.0 + 0.0, (x - 0.0) / 1.0, 0.0 * x, -(x * 0.0)), ("x",))
    assert program.steps == ()
    assert program.outputs == ("x", "x", 0.0, -0.0)


def test_constants_are_folded():
    program = trace(lambda x: (x * (2.0 * 3.0 + np.sqrt(16.0)),), ("x",))
    assert program.steps == (Step(MUL, 10.0, "x"),)


@pytest.mark.parametrize(
    "effect", ["misalignment", "sensitivity_temperature", "flip_asymmetry", "bias", "bias_temperature"]
)
def test_an_effect_at_its_null_costs_nothing(effect):
    def undo(model):
        p = np.array([2.0 if name.startswith("scale") else v for name, v in zip(model.names, model.null, strict=True)])
        at = Conditions(state=1.0, temp_c=25.0)
        return trace(lambda *xyz: model.undo(xyz, p, at), ("x", "y", "z"))

    with_it, without = (compose(names, Setup()) for names in (("scale", effect), ("scale",)))
    assert undo(with_it) == undo(without)


@pytest.mark.parametrize(
    "function",
    [
        lambda x: (x if x > 0 else -x,),
        lambda x: (np.sin(x),),
        lambda x: (np.maximum(x, 0.0),),
        lambda x: (x**0.5,),
        lambda x: (float(x),),
        lambda x: (abs(x),),
        lambda x: ("text",),
        lambda x: (np.arctan2(x, 1.0),),
    ],
)
def test_what_a_board_cannot_do_is_refused(function):
    with pytest.raises(InputError, match=r"undo must be made of \+ - \* / and np.sqrt"):
        trace(function, ("x",))
