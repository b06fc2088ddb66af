"""From double precision to the board's floats, with a bound on what is lost.

Every constant is rounded to float32, and the program is run with each operation rounded to float32, as the FPU of the
STM32F4 rounds it, over the fields, gains and temperatures that the board may meet. The error is what comes back less
the field that went in, as a fraction of full scale. What misses the limit is refused.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from barberpole.errors import InputError, LimitError, must

from barberpole_codegen.trace import ADD, DIV, MUL, NEG, SQRT, SUB, Operand, Program, Ref, Step

LIMIT = 1e-4  # of full scale
SMALLEST = float(np.finfo(np.float32).tiny)
LARGEST = float(np.finfo(np.float32).max)

_DO = {
    ADD: np.add,
    SUB: np.subtract,
    MUL: np.multiply,
    DIV: np.divide,
    NEG: np.negative,
    SQRT: np.sqrt,
}


@dataclass(frozen=True)
class Precision:
    """What narrowing costs, found by running the program.

    range_ut        full scale: fields of ± this on every axis were tried
    error_ut        largest error with every operation in float32
    inverse_ut      largest error in double: how well the inverse inverts at all
    """

    range_ut: float
    error_ut: float
    inverse_ut: float

    @property
    def fraction(self) -> float:
        """Largest float32 error as a fraction of full scale."""
        return self.error_ut / self.range_ut


def narrow(program: Program) -> Program:
    """The program with its constants rounded to float32. Raises InputError for a constant that float32 cannot hold."""

    def rounded(operand: Any) -> Any:
        return narrow_number(operand) if isinstance(operand, float) else operand

    steps = tuple(Step(s.operation, rounded(s.left), rounded(s.right)) for s in program.steps)
    return Program(program.inputs, steps, tuple(rounded(v) for v in program.outputs))


def narrow_number(value: float) -> float:
    """`value` rounded to float32. Raises InputError where that loses more than rounding."""
    if not np.isfinite(value) or abs(value) > LARGEST or 0 < abs(value) < SMALLEST:
        raise InputError(must("a coefficient", f"0 or between {SMALLEST:.3g} and {LARGEST:.3g} for float32", value))
    return float(np.float32(value))


def evaluate(program: Program, inputs: Mapping[str, np.ndarray], kind: type = np.float32) -> list[np.ndarray]:
    """Outputs for arrays of inputs, every operation rounded to `kind`."""
    given = {name: np.asarray(inputs[name], kind) for name in program.inputs}
    done: list[np.ndarray] = []

    def value(operand: Operand | None) -> np.ndarray:
        if isinstance(operand, str):
            return given[operand]
        return done[operand.step] if isinstance(operand, Ref) else np.asarray(operand, kind)

    for step in program.steps:
        done.append(np.asarray(_DO[step.operation](*(value(v) for v in step.operands)), kind))
    return [value(v) for v in program.outputs]


def precision(program: Program, inputs: Mapping[str, np.ndarray], truth: np.ndarray, range_ut: float) -> Precision:
    """Error against `truth` (outputs, n) for readings `inputs`: narrowed and in float32, and as traced in double."""
    with np.errstate(all="ignore"):  # a root of a negative number shows up as NaN, and NaN is refused
        single = _largest(evaluate(narrow(program), inputs, np.float32), truth)
        double = _largest(evaluate(program, inputs, np.float64), truth)
    return Precision(range_ut, single, double)


def require(found: Precision, what: str) -> None:
    """Raise LimitError where the float32 error exceeds the limit."""
    if not found.fraction <= LIMIT:
        limit = f"within {LIMIT:g} of full scale (±{found.range_ut:g} µT) in float32"
        raise LimitError(must(what, limit, f"{found.fraction:.2g}"))


def _largest(outputs: list[np.ndarray], truth: np.ndarray) -> float:
    worst = 0.0
    for output, wanted in zip(outputs, truth, strict=True):
        error = np.abs(np.broadcast_to(output, wanted.shape).astype(float) - wanted)
        worst = max(worst, float(np.max(np.where(np.isfinite(error), error, np.inf))))
    return worst
