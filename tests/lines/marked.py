"""The firmware with a marker before each statement, as MicroPython's own tracing is not compiled into the interpreter.

A marker says its number at the first passing, by a write of two bytes that no later kill of the interpreter takes
back. It allocates nothing, so checks on a locked heap stay what they are, and viper functions call it like any other.
"""

import ast
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field

RECORDER = """\
# _lines.py: which markers were passed. Unbuffered and in place, so nothing is allocated and nothing is lost by a kill.
_seen = bytearray({count})
_word = bytearray(2)
_file = open({path!r}, "ab", buffering=0)


def passed(number):
    if not _seen[number]:
        _seen[number] = 1
        _word[0] = number & 255
        _word[1] = number >> 8
        _file.write(_word)
"""
HEADER = """\
try:
    from _lines import passed as _passed
except ImportError:  # CPython, or a MicroPython that only measures memory

    def _passed(number):
        pass

"""
Edit = tuple[int, int, str]  # line, byte in it, what is put in there


@dataclass
class Markers:
    """Where each marker stands, by its number: the file, and the lines that were run when it was passed."""

    places: list[tuple[str, list[int]]] = field(default_factory=list)

    def marked(self, name: str, text: str) -> str:
        """The module with a marker before each statement; all else stays as written, down to what it allocates."""
        lines = text.encode().splitlines()
        edits = [edit for node, block in _blocks(ast.parse(text)) for edit in self._edits(name, lines, node, block)]
        for row, column, new in sorted(edits, reverse=True):
            lines[row - 1] = lines[row - 1][:column] + new.encode() + lines[row - 1][column:]
        return HEADER + b"\n".join(lines).decode() + "\n"

    def _edits(self, name: str, lines: list[bytes], node: ast.AST, block: list[ast.stmt]) -> Iterator[Edit]:
        above = [node.lineno] if isinstance(node, ast.ExceptHandler) else []  # run where its first statement is
        for statement in block:
            first = min([statement.lineno, *(d.lineno for d in getattr(statement, "decorator_list", []))])
            marker = self._passed(name, [*above, *range(first, statement.lineno + 1)])
            above = []
            if isinstance(statement, ast.If) and lines[first - 1][statement.col_offset :].startswith(b"elif"):
                test = statement.test
                yield test.lineno, test.col_offset, f"{marker} or ("
                yield test.end_lineno or 0, test.end_col_offset or 0, ")"
            else:
                yield first, 0, " " * statement.col_offset + marker + "\n"

    def _passed(self, name: str, lines: list[int]) -> str:
        self.places.append((name, lines))
        return f"_passed({len(self.places) - 1})"

    def recorder(self, path: str) -> str:
        """Text of the module _lines, which writes to the file `path`."""
        return RECORDER.format(count=len(self.places), path=path)

    def lines(self, record: bytes) -> dict[str, set[int]]:
        """File -> the lines that were run, from what was written by any number of interpreters."""
        found: dict[str, set[int]] = {name: set() for name, _ in self.places}
        for number in {number for (number,) in struct.iter_unpack("<H", record)}:
            name, lines = self.places[number]
            found[name].update(lines)
        return found


def _blocks(tree: ast.Module) -> Iterator[tuple[ast.AST, list[ast.stmt]]]:
    """Each list of statements, with the node that it belongs to."""
    for node in ast.walk(tree):
        for name in ("body", "orelse", "finalbody"):
            block = getattr(node, name, None)
            if isinstance(block, list):
                yield node, block
