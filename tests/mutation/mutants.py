"""Mutants of a module: each is its text with one small fault, of a kind that people make.

Left alone: texts, annotations, decorators, docstrings, and `strict=` of zip, where nothing that is computed can change.
"""

import ast
from collections.abc import Iterator
from dataclasses import dataclass

SWAPS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.FloorDiv,
    ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.BitXor: ast.BitAnd,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
    ast.And: ast.Or,
    ast.Or: ast.And,
}
NAMES = {"min": "max", "any": "all", "sin": "cos", "maximum": "minimum", "floor": "ceil", "argmin": "argmax"}
NAMES |= {"log": "log10", "sqrt": "square", "mean": "median", "sorted": "list", "cumsum": "array"}
NAMES |= {other: name for name, other in list(NAMES.items()) if other not in ("list", "array", "square", "log10")}
SKIPPED = (ast.JoinedStr, ast.arg, ast.Import, ast.ImportFrom)


@dataclass(frozen=True)
class Mutant:
    """A fault in `module`, which is `text` then: the code `before` of `line` reads `after`."""

    module: str
    line: int
    kind: str
    before: str
    after: str
    text: str

    @property
    def key(self) -> str:
        """What stays the same when lines move."""
        return f"{self.module}: `{self.before}` -> `{self.after}`"


def mutants(module: str, text: str) -> list[Mutant]:
    """All mutants of a module, in the order of its text."""
    lines = text.encode().splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line))
    found = []
    for kind, node, new in _faults(ast.parse(text)):
        begin = starts[node.lineno - 1] + node.col_offset
        end = starts[node.end_lineno - 1] + node.end_col_offset
        data = text.encode()
        after = f"({new})" if isinstance(node, ast.expr) and kind not in ("constant", "name", "slice") else new
        changed = (data[:begin] + after.encode() + data[end:]).decode()
        line = node.lineno - 1
        before, after = (whole.split("\n", line + 1)[line].strip() for whole in (text, changed))
        found.append(Mutant(module, line + 1, kind, before, after, changed))
    return sorted({m.key: m for m in found if m.before != m.after}.values(), key=lambda m: (m.line, m.after))


def compiles(mutant: Mutant) -> bool:
    """Whether it is Python at all."""
    try:
        compile(mutant.text, "mutant", "exec")
    except SyntaxError:
        return False
    return True


def _faults(tree: ast.Module) -> Iterator[tuple[str, ast.AST, str]]:
    """(kind, node, what stands in its place) of everything in the tree that can be mutated."""
    for node in _nodes(tree):
        match node:
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in SWAPS:
                yield "comparison", node, ast.unparse(ast.Compare(left, [SWAPS[type(op)]()], [right]))
            case ast.BinOp(left=left, op=op, right=right) if type(op) in SWAPS:
                yield "arithmetic", node, ast.unparse(ast.BinOp(left, SWAPS[type(op)](), right))
            case ast.AugAssign(target=target, op=op, value=value) if type(op) in SWAPS:
                yield "arithmetic", node, ast.unparse(ast.AugAssign(target, SWAPS[type(op)](), value))
            case ast.BoolOp(op=op, values=values):
                yield "boolean", node, ast.unparse(ast.BoolOp(SWAPS[type(op)](), values))
            case ast.UnaryOp(op=ast.Not() | ast.USub() | ast.Invert(), operand=operand):
                yield "sign", node, ast.unparse(operand)
            case ast.Constant(value=value) if isinstance(value, (bool, int, float, complex)):
                yield "constant", node, _other(value)
            case ast.If(test=test) | ast.IfExp(test=test) | ast.While(test=test):
                yield "condition", test, f"not ({ast.unparse(test)})"
            case ast.comprehension(ifs=[test]):
                yield "condition", test, "True"
            case ast.Return(value=ast.expr() as value) if not isinstance(value, ast.Constant):
                yield "return", value, "None"
            case ast.Expr(value=ast.Call()) | ast.Raise():
                yield "statement", node, "pass"
            case ast.Continue() | ast.Break():
                yield "statement", node, "break" if isinstance(node, ast.Continue) else "continue"
            case ast.Slice(lower=lower, upper=upper) if lower is not None and upper is not None:
                yield "slice", lower, ""
                yield "slice", upper, ""
            case ast.Call(func=ast.Name(id=name) as place) if name in NAMES:
                yield "name", place, NAMES[name]
            case ast.Call(func=ast.Attribute(value=value, attr=name) as place) if name in NAMES:
                yield "name", place, f"{ast.unparse(value)}.{NAMES[name]}"


def _other(value: bool | int | float | complex) -> str:
    if isinstance(value, bool):
        return repr(not value)
    if isinstance(value, int):
        return repr(value + 1)
    return repr(2 * value) if value else "1.0"


def _nodes(node: ast.AST) -> Iterator[ast.AST]:
    """All nodes that something is computed of."""
    yield node
    for name, value in ast.iter_fields(node):
        if name in ("decorator_list", "annotation", "returns", "bases"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if not isinstance(child, ast.AST) or isinstance(child, SKIPPED):
                continue
            if isinstance(child, ast.keyword) and child.arg == "strict":
                continue
            yield from _nodes(child)
