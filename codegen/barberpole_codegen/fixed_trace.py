"""A traced program, operation by operation, to fixed point.

Each operand is a number, a slow value, or a register. Slow is what depends on nothing but inputs that change once per
power-up (today's gains): it is left to floats, and its results, inverted where something is divided by them, are put
into registers by the board when they change.
"""

import math
from collections.abc import Mapping

from barberpole.errors import LimitError, must

from barberpole_codegen.fixed import ADD_OP, SLACK, SUB_OP, Fixed, FixedProgram, Interval, exponent
from barberpole_codegen.fixed_machine import Machine
from barberpole_codegen.trace import ADD, DIV, MUL, NEG, SQRT, SUB, Operand, Program, Ref, Step

FLOAT32 = 2.0**-22  # relative error of a slow value: a few float32 operations


def fix(program: Program, inputs: Mapping[str, Fixed], slow: Mapping[str, Interval]) -> FixedProgram:
    """`program` in fixed point. `inputs`: interval, k and error of each fast input (their registers are set here);
    `slow`: interval of each input that changes once per power-up.

    Raises LimitError where a divisor or the argument of a root comes too near to zero in these intervals.
    """
    return _Translation(program, slow).run(inputs)


class _Slow:
    """Steps on slow inputs alone, in floats: an expression is an input's name or a Ref to one of `steps`."""

    def __init__(self, boxes: Mapping[str, Interval]):
        self._boxes: dict[Operand, Interval] = {**boxes}
        self.steps: list[Step] = []

    def do(self, operation: str, *operands: Operand) -> Operand:
        step = Step(operation, *operands)
        if step not in self.steps:
            self.steps.append(step)
            self._boxes[Ref(len(self.steps) - 1)] = _slow_interval(operation, [self.box(v) for v in operands])
        return Ref(self.steps.index(step))

    def box(self, operand: Operand) -> Interval:
        return Interval(operand, operand) if isinstance(operand, float) else self._boxes[operand]


class _Translation:
    """One program on its way."""

    def __init__(self, program: Program, slow: Mapping[str, Interval]):
        self._program, self._names = program, tuple(slow)
        self._machine, self._slow = Machine(), _Slow(slow)
        self._fast: dict[Operand, Fixed] = {}
        self._expression: dict[Operand, Operand] = {name: name for name in slow}  # of slow operands
        self._hoisted: dict[Operand, Fixed] = {}

    def run(self, inputs: Mapping[str, Fixed]) -> FixedProgram:
        placed = {name: self._machine.register(v.interval, v.k, v.error) for name, v in inputs.items()}
        self._fast.update(placed)
        for index, step in enumerate(self._program.steps):
            if all(isinstance(v, float) or v in self._expression for v in step.operands):
                operands = [v if isinstance(v, float) else self._expression[v] for v in step.operands]
                self._expression[Ref(index)] = self._slow.do(step.operation, *operands)
            else:
                self._fast[Ref(index)] = self._do(step)
        outputs = tuple(self._value(v) for v in self._program.outputs)
        slow_float = Program(self._names, tuple(self._slow.steps), tuple(self._hoisted))
        return FixedProgram(
            self._machine.registers,
            self._machine.constants,
            placed,
            tuple(self._hoisted.values()),
            slow_float,
            tuple(self._machine.instructions),
            outputs,
        )

    def _do(self, step: Step) -> Fixed:
        machine, left, right = self._machine, step.left, step.right
        if step.operation == SQRT:
            s = self._value(left)
            root = Interval(*(math.sqrt(max(v, 0.0)) for v in (s.interval.low, s.interval.high)))
            return machine.mul(s, machine.inverse_root(s), root)
        if right is None:
            return machine.scaled(self._value(left), -1.0)
        if step.operation == DIV:
            return self._divide(left, right)
        if step.operation == MUL:
            return self._multiply(left, right)
        return machine.add(self._value(left), self._value(right), ADD_OP if step.operation == ADD else SUB_OP)

    def _multiply(self, left: Operand, right: Operand) -> Fixed:
        if isinstance(left, float):
            return self._machine.scaled(self._value(right), left)
        if isinstance(right, float):
            return self._machine.scaled(self._value(left), right)
        return self._machine.mul(self._value(left), self._value(right))

    def _divide(self, left: Operand, right: Operand) -> Fixed:
        """A constant or a slow divisor is inverted beforehand; a root is the inverse root's inverse."""
        machine = self._machine
        if isinstance(right, float):
            return machine.scaled(self._value(left), 1.0 / right)
        if right in self._expression:
            inverse = self._hoist(self._slow.do(DIV, 1.0, self._expression[right]))
        elif isinstance(right, Ref) and self._program.steps[right.step].operation == SQRT:
            inverse = machine.inverse_root(self._value(self._program.steps[right.step].left))
        else:
            inverse = machine.inverse(self._value(right))
        return inverse if left == 1.0 else machine.mul(self._value(left), inverse)

    def _value(self, operand: Operand) -> Fixed:
        if isinstance(operand, float):
            return self._machine.constant(operand)
        return self._fast[operand] if operand in self._fast else self._hoist(self._expression[operand])

    def _hoist(self, expression: Operand) -> Fixed:
        if expression not in self._hoisted:
            box = self._slow.box(expression)
            error = box.largest * FLOAT32
            made = self._machine.register(box, exponent((box.largest + error) * SLACK), error)
            self._hoisted[expression] = made
        return self._hoisted[expression]


def _slow_interval(operation: str, boxes: list[Interval]) -> Interval:
    a, b = boxes[0], boxes[-1]
    if operation == NEG:
        return Interval(-a.high, -a.low)
    if operation == SQRT:
        return Interval(math.sqrt(a.low), math.sqrt(a.high))
    if operation == ADD:
        return Interval(a.low + b.low, a.high + b.high)
    if operation == SUB:
        return Interval(a.low - b.high, a.high - b.low)
    if operation == DIV:
        if b.low <= 0 <= b.high:
            raise LimitError(
                must("what is divided by", "away from zero", f"{b.low:.3g} to {b.high:.3g}", "fixed point")
            )
        b = Interval(1.0 / b.high, 1.0 / b.low)
    corners = [x * y for x in (a.low, a.high) for y in (b.low, b.high)]
    return Interval(min(corners), max(corners))
