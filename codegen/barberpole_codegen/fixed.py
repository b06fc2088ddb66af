"""From a traced program to 32-bit fixed point, with a proof that nothing overflows and a bound on the error.

A value v is held as an integer n with v = n 2^(k-30) and |n| < 2^30; k is chosen per value from the interval that it
can reach when every input stays in its box. There are three operations, which firmware/bp_fixed.py does on the board:

    mul   (a b) >> (30 - left)              exact to one unit of the result (Python's floor)
    add   ((a >> sa) + (b >> sb)) << left   one unit for each operand that is shifted
    sub   the same with b taken away

Quotients and roots are products: a straight line as first guess, then as many Newton steps as the interval needs. What
depends on slow inputs alone (today's gains) is left to floats, once per power-up. The bound is the worst case: every
rounding at its largest and all of one sign.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from barberpole_codegen.trace import Program

BITS = 30
ONE = 1 << BITS
MUL_OP, ADD_OP, SUB_OP = 0, 1, 2
SLACK = 1.0 + 1e-9  # intervals are computed in double


@dataclass(frozen=True)
class Interval:
    """Bounds of a value."""

    low: float
    high: float

    @property
    def largest(self) -> float:
        return max(abs(self.low), abs(self.high))

    def wider(self, by: float) -> "Interval":
        return Interval(self.low - by, self.high + by)


@dataclass(frozen=True)
class Fixed:
    """A value in a register: exact value within `interval`, what the register holds off by at most `error`."""

    register: int
    k: int
    interval: Interval
    error: float = 0.0

    @property
    def unit(self) -> float:
        return 2.0 ** (self.k - BITS)


@dataclass(frozen=True)
class Instruction:
    """One operation on registers."""

    operation: int
    into: int
    a: int
    b: int
    right_a: int = 0
    right_b: int = 0
    left: int = 0


@dataclass(frozen=True)
class FixedProgram:
    """What runs on the board.

    registers   how many; constants: register -> integer; inputs, slow, outputs: where they stand, and their scale
    slow_float  the float program of the slow values, in the order of `slow`
    """

    registers: int
    constants: dict[int, int]
    inputs: dict[str, Fixed]
    slow: tuple[Fixed, ...]
    slow_float: Program
    instructions: tuple[Instruction, ...]
    outputs: tuple[Fixed, ...]


def exponent(largest: float) -> int:
    """The smallest k with largest < 2^k."""
    return math.frexp(largest)[1] if largest > 0 else -BITS


def execute(program: FixedProgram, inputs: Mapping[str, np.ndarray], slow: Iterable[int]) -> list[np.ndarray]:
    """Output registers for arrays of input registers, with Python's integers: as the board does it.

    Raises OverflowError where any intermediate result leaves 32 bits, which the proof excludes.
    """
    n = len(next(iter(inputs.values())))
    r = np.zeros((program.registers, n), np.int64)
    for at, value in program.constants.items():
        r[at] = value
    for name, values in inputs.items():
        r[program.inputs[name].register] = values
    for made, value in zip(program.slow, slow, strict=True):
        r[made.register] = value
    for i in program.instructions:
        r[i.into] = _word(_operate(i, r[i.a], r[i.b]), 30)
    return [r[v.register] for v in program.outputs]


def _operate(i: Instruction, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    if i.operation != MUL_OP:
        b = b >> i.right_b
        return _word((a >> i.right_a) + (b if i.operation == ADD_OP else -b)) << i.left
    a_high, a_low, b_high, b_low = a >> 15, a & 0x7FFF, b >> 15, b & 0x7FFF
    middle = _word(_word(a_high * b_low) + _word(a_low * b_high) + (a_low * b_low >> 15))
    return (_word(a_high * b_high) << i.left) + (middle >> (15 - i.left))


def _word(value: np.ndarray, bits: int = 31) -> np.ndarray:
    if np.any(value >= 1 << bits) or np.any(value < -(1 << bits)):
        raise OverflowError(f"a value left {bits + 1} bits")
    return value
