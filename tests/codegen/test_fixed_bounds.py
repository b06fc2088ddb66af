"""Every register of a fixed-point program: it holds what its interval and its error say, not only the outputs do."""

from dataclasses import replace

import numpy as np
import pytest
from barberpole.errors import LimitError
from barberpole_codegen.fixed import BITS, MUL_OP, Fixed, Instruction, Interval, execute, exponent
from barberpole_codegen.fixed_machine import ENOUGH, Machine, _line_to_inverse_root
from barberpole_codegen.fixed_trace import _slow_interval, fix
from barberpole_codegen.trace import ADD, DIV, MUL, NEG, SQRT, SUB, _number, trace

N = 4000


def boxed(low, high):
    return Fixed(-1, exponent(max(abs(low), abs(high)) * 1.01), Interval(low, high))


@pytest.fixture
def registered(monkeypatch):
    """All registers that are made, with what is claimed of them."""
    made = []

    def register(self, interval, k, error, really=Machine.register):
        made.append(really(self, interval, k, error))
        return made[-1]

    monkeypatch.setattr(Machine, "register", register)
    return made


CASES = {
    "inverse": (lambda x: (1.0 / x,), {"x": (0.3, 11.0)}),
    "inverse of what is below zero": (lambda x: (2.0 / x,), {"x": (-3.0, -0.9)}),
    "inverse of a narrow interval": (lambda x: (1.0 / x,), {"x": (0.99, 1.02)}),
    "root": (lambda x: (x.sqrt(),), {"x": (0.0755, 2.9)}),
    "root of large numbers": (lambda x: (1.0 / x.sqrt(),), {"x": (4e5, 3e6)}),
    "film": (
        lambda x, y: (x * (1.0 - 0.002 * y) / (1.0 + 1e-6 * x * y - (0.5 + 0.001 * y).sqrt()),),
        {"x": (-90.0, 80.0), "y": (-60.0, 70.0)},
    ),
    "signs": (
        lambda x, y: (-x * y - 3.0 * x, (x - y) * (x - y), 4.0 * y - -0.25 * x),
        {"x": (-2.0, 1.0), "y": (3.0, 4.0)},
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_every_register_holds_what_is_claimed(case, registered):
    function, boxes = CASES[case]
    program = fix(trace(function, tuple(boxes)), {name: boxed(*box) for name, box in boxes.items()}, {})
    rng = np.random.default_rng(4)
    given = {}
    for name, (low, high) in boxes.items():
        scale = 2.0 ** (BITS - program.inputs[name].k)
        values = low + np.concatenate([[0.0, 1.0], rng.uniform(size=N - 2)]) * (high - low)
        given[name] = np.clip(np.round(values * scale), np.ceil(low * scale), np.floor(high * scale)).astype(np.int64)
    found = execute(replace(program, outputs=tuple(registered)), given, [])
    assert len(registered) == program.registers
    for claimed, n in zip(registered, found, strict=True):
        value = n * claimed.unit
        assert np.all(value >= claimed.interval.low - claimed.error), claimed
        assert np.all(value <= claimed.interval.high + claimed.error), claimed
        assert np.max(np.abs(n)) < 1 << BITS
    moving = [n for n, claimed in zip(found, registered, strict=True) if claimed.interval.low < claimed.interval.high]
    widest = max(np.max(np.abs(n)) for n in moving)
    assert widest > 1 << BITS - 2  # the bits are used


def test_a_newton_step_more_is_taken_only_where_it_is_needed(registered):
    narrow, wide = (fix(trace(lambda x: (1.0 / x,), ("x",)), {"x": boxed(1.0, top)}, {}) for top in (1.0001, 9.0))
    products = [sum(i.operation == MUL_OP for i in made.instructions) for made in (narrow, wide)]
    assert products[0] == 1 + 2  # the line is right to 3e-10: one step
    off, steps = (9.0 - 1.0) ** 2 / (2 * 10.0**2 - 8.0**2), 0  # Chebyshev's line, then its square, and so on
    while off >= ENOUGH:
        off, steps = off * off, steps + 1
    assert products[1] == 1 + 2 * steps


@pytest.mark.parametrize(("function", "limit"), [(lambda x: (1.0 / x,), 64.0), (lambda x: (x.sqrt(),), 40.0)])
def test_up_to_its_limit_an_interval_is_served_and_beyond_it_refused(function, limit):
    made = fix(trace(function, ("x",)), {"x": boxed(1.0, 0.99 * limit)}, {})
    assert made.outputs[0].error < 1e-6 * made.outputs[0].interval.high
    for top in (1.01 * limit, 1.5 * limit, 100.0 * limit):
        with pytest.raises(LimitError, match=f"within a factor {limit:g}; got 1 to"):
            fix(trace(function, ("x",)), {"x": boxed(1.0, top)}, {})


@pytest.mark.parametrize(("low", "high"), [(0.1, 0.2), (1.0, 30.0), (3e4, 4e4), (2.0, 2.0)])
def test_first_guess_of_a_root_is_as_far_off_at_its_ends_as_in_its_middle(low, high):
    start, slope, off = _line_to_inverse_root(low, high)
    s = np.linspace(low, high, 20001)
    apart = (start - slope * s) * np.sqrt(s) - 1.0
    assert np.max(np.abs(apart)) <= off
    assert np.max(np.abs(apart)) > off - 3e-6
    if high > low:
        assert -apart.min() == pytest.approx(apart.max(), abs=2e-6)
        assert apart[0] == pytest.approx(apart[-1], abs=1e-12)


def test_shifts_are_those_that_the_board_has():
    made = Machine()
    a = made.register(Interval(-1e-6, 1e-6), -19, 0.0)
    b = made.register(Interval(-1e6, 1e6), 20, 0.0)
    apart = made.add(a, b, MUL_OP + 1)
    assert made.instructions[-1].right_a == 31  # of a number that is nothing beside the other
    assert apart.interval == Interval(-1e6 - 1e-6, 1e6 + 1e-6)
    small = made.mul(a, a)
    assert made.instructions[-1] == Instruction(MUL_OP, small.register, a.register, a.register, left=-38 - small.k)
    assert small.interval == Interval(0.0, 1e-12)
    assert small.k == max(exponent(1e-12), -38 - 15)
    assert made.constant(3.0) is made.constant(3.0)
    assert made.constants[made.constant(3.0).register] * 2.0 ** (made.constant(3.0).k - BITS) == 3.0


def test_slow_values_stay_in_their_intervals():
    rng = np.random.default_rng(6)
    for _ in range(300):
        (a, b), (c, d) = np.sort(rng.normal(size=(2, 2)) * rng.choice([0.1, 1.0, 10.0], (2, 1)), axis=1)
        x, y = rng.uniform(a, b, 50), rng.uniform(c, d, 50)
        x[:2], y[:4] = (a, b), (c, d, d, c)
        boxes = [Interval(a, b), Interval(c, d)]
        results = {ADD: x + y, SUB: x - y, MUL: x * y}
        if c * d > 0:
            results[DIV] = x / y
        for operation, values in results.items():
            box = _slow_interval(operation, boxes)
            assert np.all((values >= box.low - 1e-12 * box.largest) & (values <= box.high + 1e-12 * box.largest))
        assert _slow_interval(NEG, boxes[:1]) == Interval(-b, -a)
        if a > 0:
            assert _slow_interval(SQRT, boxes[:1]) == Interval(np.sqrt(a), np.sqrt(b))
    assert _slow_interval(DIV, [Interval(1.0, 2.0), Interval(-4.0, -2.0)]) == Interval(-1.0, -0.25)
    assert _slow_interval(MUL, [Interval(-3.0, 2.0), Interval(-1.0, 4.0)]) == Interval(-12.0, 8.0)


def test_numbers_known_beforehand_are_worked_out():
    both = {ADD: 12.25, SUB: 5.75, MUL: 29.25, DIV: 9.0 / 3.25}
    assert {operation: _number(operation, 9.0, 3.25) for operation in both} == both
    assert (_number(NEG, 9.0, None), _number(SQRT, 9.0, None)) == (-9.0, 3.0)
