"""Fixed point: nothing overflows, nothing is further off than the bound says, and what cannot be proved is refused."""

import numpy as np
import pytest
from barberpole.errors import LimitError
from barberpole_codegen.fixed import BITS, Fixed, Interval, execute, exponent
from barberpole_codegen.fixed_trace import fix
from barberpole_codegen.narrow import evaluate
from barberpole_codegen.trace import trace

N = 5000


def boxed(low, high):
    return Fixed(-1, exponent(max(abs(low), abs(high)) * 1.01), Interval(low, high))


def edges(rng, low, high, n=N):
    """Integers of the interval: a third at its ends."""
    inner = rng.integers(low, high + 1, n)
    return np.where(rng.random(n) < 1 / 3, np.where(rng.random(n) < 0.5, low, high), inner)


def compare(function, boxes, slow=None, gains=None):
    """Largest error over the bound of each output, with Python's integers against double."""
    slow, gains = slow or {}, gains or {}
    program = trace(function, (*boxes, *slow))
    made = fix(program, {name: boxed(*box) for name, box in boxes.items()}, slow)
    rng = np.random.default_rng(3)
    scale = {name: 2.0 ** (BITS - v.k) for name, v in made.inputs.items()}
    given = {n: edges(rng, np.ceil(low * scale[n]), np.floor(high * scale[n])) for n, (low, high) in boxes.items()}
    floats = evaluate(made.slow_float, {name: np.asarray(v) for name, v in gains.items()}, np.float64)
    held = [round(float(v) * 2.0 ** (BITS - place.k)) for v, place in zip(floats, made.slow, strict=True)]
    found = execute(made, given, held)
    values = {n: v / scale[n] for n, v in given.items()} | {n: np.full(N, v) for n, v in gains.items()}
    exact = evaluate(program, values, np.float64)
    pairs = zip(found, made.outputs, exact, strict=True)
    return [float(np.max(np.abs(n * 2.0 ** (v.k - BITS) - x))) / v.error for n, v, x in pairs]


CASES = {
    "sum of unlike sizes": (lambda x, y: (x + y, x - y), {"x": (-1e6, 2e6), "y": (-0.3, 0.2)}),
    "product": (lambda x, y: (x * y, x * x), {"x": (-7.0, 3.0), "y": (-1e-4, 2e-4)}),
    "constants": (lambda x: (3.7 * x - 2e-3, -0.5 * x, x / 1.01), {"x": (-40.0, 1.0)}),
    "quotient": (lambda x, y: (x / y, x / (y * -1.0)), {"x": (-7.0, 3.0), "y": (0.4, 9.0)}),
    "root": (lambda x: (x.sqrt(), 1.0 / x.sqrt()), {"x": (0.31, 2.9)}),
    "root of a narrow interval": (lambda x: ((0.5 + 0.5 * (1.0 - x * x).sqrt()).sqrt(),), {"x": (-0.6, 0.7)}),
}


@pytest.mark.parametrize("case", CASES)
def test_never_further_off_than_the_bound(case):
    ratios = compare(*CASES[case])
    assert max(ratios) <= 1.0
    assert max(ratios) > 0.01  # and the bound says something


def test_slow_values_are_left_to_floats():
    function = lambda x, g: (x / (0.3 * g), x * g)  # noqa: E731
    ratios = compare(function, {"x": (-5.0, 5.0)}, {"g": Interval(0.9, 1.1)}, {"g": 1.037})
    assert max(ratios) <= 1.0
    made = fix(trace(function, ("x", "g")), {"x": boxed(-5.0, 5.0)}, {"g": Interval(0.9, 1.1)})
    assert len(made.slow) == 2
    assert len(made.instructions) == 2  # products with 1 / (0.3 g) and with g


@pytest.mark.parametrize("box", [(-1.0, 1.0), (1e-4, 1.0)])
@pytest.mark.parametrize("function", [lambda x: (1.0 / x,), lambda x: (x.sqrt(),)])
def test_what_comes_too_near_to_zero_is_refused(function, box):
    with pytest.raises(LimitError, match="away from zero"):
        fix(trace(function, ("x",)), {"x": boxed(*box)}, {})


def test_leaving_32_bits_is_noticed():
    made = fix(trace(lambda x: (x * 1.5 + x,), ("x",)), {"x": boxed(-1.0, 1.0)}, {})
    with pytest.raises(OverflowError, match="bits"):
        execute(made, {"x": np.array([1 << 33])}, [])
