"""Plain arithmetic, run on symbols, becomes a list of operations.

`trace` calls a function with symbols in place of numbers and collects what it does. Equal operations are found and
done once; operations on numbers alone are done here and now, so that a parameter at its null leaves no trace.
Only + - * / negation and the square root can be traced: what branches or calls anything else is refused.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from barberpole.errors import InputError, must

ADD, SUB, MUL, DIV, NEG, SQRT = "+", "-", "*", "/", "neg", "sqrt"


@dataclass(frozen=True, order=True)
class Ref:
    """The result of an earlier step."""

    step: int


Operand = Ref | str | float  # result of a step, name of an input, constant


@dataclass(frozen=True)
class Step:
    """One operation; `right` is None for negation and square root."""

    operation: str
    left: Operand
    right: Operand | None = None

    @property
    def operands(self) -> tuple[Operand, ...]:
        return (self.left,) if self.right is None else (self.left, self.right)


@dataclass(frozen=True)
class Program:
    """Straight-line arithmetic: each step uses inputs, constants and earlier steps."""

    inputs: tuple[str, ...]
    steps: tuple[Step, ...]
    outputs: tuple[Operand, ...]

    def count(self) -> dict[str, int]:
        """How often each operation occurs."""
        found: dict[str, int] = {}
        for step in self.steps:
            found[step.operation] = found.get(step.operation, 0) + 1
        return found


class _Graph:
    """Steps so far, each different from all others."""

    def __init__(self) -> None:
        self.steps: list[Step] = []
        self._known: dict[Step, Ref] = {}

    def add(self, operation: str, left: Operand, right: Operand | None = None) -> Operand:
        folded = _fold(operation, left, right)
        if folded is not None:
            return folded
        operation, left, right = _simpler(operation, left, right)
        if operation in (ADD, MUL) and _order(right) < _order(left):  # both commute exactly in floating point
            left, right = right, left  # type: ignore[assignment]
        step = Step(operation, left, right)
        if step not in self._known:
            self._known[step] = Ref(len(self.steps))
            self.steps.append(step)
        return self._known[step]


def _order(operand: Operand | None) -> tuple[int, str, int]:
    """Constants first, then inputs, then steps."""
    if isinstance(operand, Ref):
        return 2, "", operand.step
    return (0, f"{operand!r}", 0) if isinstance(operand, float) else (1, str(operand), 0)


def _fold(operation: str, left: Operand, right: Operand | None) -> Operand | None:
    """The result where no operation is needed: numbers alone, or a neutral element."""
    if isinstance(left, float) and (right is None or isinstance(right, float)):
        return _number(operation, left, right)
    if operation == ADD:
        return right if left == 0.0 else left if right == 0.0 else None
    if operation == SUB:
        return left if right == 0.0 else None
    if operation == MUL:
        if 0.0 in (left, right):
            return 0.0
        return right if left == 1.0 else left if right == 1.0 else None
    if operation == DIV:
        return 0.0 if left == 0.0 else left if right == 1.0 else None
    return None


def _simpler(operation: str, left: Operand, right: Operand | None) -> tuple[str, Operand, Operand | None]:
    """The same to the last bit, easier to read: no product with -1, no negative number taken away."""
    if operation == MUL and -1.0 in (left, right):
        return NEG, right if left == -1.0 and right is not None else left, None
    if operation in (ADD, SUB) and isinstance(right, float) and right < 0:
        return SUB if operation == ADD else ADD, left, -right
    return operation, left, right


def _number(operation: str, left: float, right: float | None) -> float:
    if right is None:
        return -left if operation == NEG else math.sqrt(left)
    return {ADD: left + right, SUB: left - right, MUL: left * right}[operation] if operation != DIV else left / right


class Symbol:
    """Stands for a number while a function is traced. numpy's scalars, arrays of objects and np.sqrt accept it."""

    __slots__ = ("_graph", "value")
    __array_priority__ = 1000

    def __init__(self, graph: _Graph, value: Operand) -> None:
        self._graph = graph
        self.value = value

    def _do(self, operation: str, other: Any, reverse: bool = False) -> Any:
        operand = _operand(other)
        if operand is None:
            return NotImplemented
        left, right = (operand, self.value) if reverse else (self.value, operand)
        return Symbol(self._graph, self._graph.add(operation, left, right))

    def __add__(self, other):
        return self._do(ADD, other)

    def __radd__(self, other):
        return self._do(ADD, other, reverse=True)

    def __sub__(self, other):
        return self._do(SUB, other)

    def __rsub__(self, other):
        return self._do(SUB, other, reverse=True)

    def __mul__(self, other):
        return self._do(MUL, other)

    def __rmul__(self, other):
        return self._do(MUL, other, reverse=True)

    def __truediv__(self, other):
        return self._do(DIV, other)

    def __rtruediv__(self, other):
        return self._do(DIV, other, reverse=True)

    def __neg__(self):
        return Symbol(self._graph, self._graph.add(NEG, self.value))

    def __pos__(self):
        return self

    def sqrt(self):
        """What np.sqrt calls on an object."""
        return Symbol(self._graph, self._graph.add(SQRT, self.value))

    def __pow__(self, exponent):
        if exponent not in (2, 3):
            raise _refused(f"a power of {exponent!r}")
        square = self * self
        return square if exponent == 2 else square * self

    def __array_ufunc__(self, ufunc, method, *inputs, **kwargs):
        """numpy's own operators: done element by element on objects."""
        if method != "__call__":
            raise _refused(f"np.{ufunc.__name__}.{method}")
        boxed = [_boxed(v) if isinstance(v, Symbol) else v for v in inputs]
        try:
            return ufunc(*boxed, **kwargs)
        except (TypeError, AttributeError):
            raise _refused(f"np.{ufunc.__name__}") from None

    def _branch(self, *_):
        raise _refused("a comparison or a branch")

    __lt__ = __le__ = __gt__ = __ge__ = __bool__ = __float__ = __int__ = __abs__ = _branch


def _boxed(symbol: Symbol) -> np.ndarray:
    box = np.empty((), dtype=object)
    box[()] = symbol
    return box


def _operand(value: Any) -> Operand | None:
    if isinstance(value, Symbol):
        return value.value
    if isinstance(value, int | float | np.integer | np.floating):
        return float(value)
    return None


def _refused(what: str) -> InputError:
    return InputError(must("an effect's undo", "made of + - * / and np.sqrt to run on a board", what))


def trace(function: Callable[..., Sequence[Any]], inputs: Sequence[str]) -> Program:
    """The program of `function`, called with one symbol for each input, as it returns its outputs.

    Raises InputError where the function does what cannot be traced.
    """
    graph = _Graph()
    results = function(*(Symbol(graph, name) for name in inputs))
    outputs = tuple(_output(result) for result in results)
    return _live(Program(tuple(inputs), tuple(graph.steps), outputs))


def _output(result: Any) -> Operand:
    operand = _operand(result.item() if isinstance(result, np.ndarray) and result.ndim == 0 else result)
    if operand is None:
        raise _refused(f"a result of type {type(result).__name__}")
    return operand


def _live(program: Program) -> Program:
    """Without the steps that no output needs."""
    needed: set[int] = set()
    waiting = [v.step for v in program.outputs if isinstance(v, Ref)]
    while waiting:
        index = waiting.pop()
        if index not in needed:
            needed.add(index)
            waiting += [v.step for v in program.steps[index].operands if isinstance(v, Ref)]
    new = {old: at for at, old in enumerate(sorted(needed))}

    def moved(operand: Operand | None) -> Any:
        return Ref(new[operand.step]) if isinstance(operand, Ref) else operand

    steps = tuple(
        Step(s.operation, moved(s.left), moved(s.right)) for at, s in enumerate(program.steps) if at in needed
    )
    return Program(program.inputs, steps, tuple(moved(v) for v in program.outputs))
