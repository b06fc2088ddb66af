"""One case: which file is damaged how, and which command reads it. Seed and number say all of it."""

import random
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fuzzing.damage import damaged
from fuzzing.files import Kind


@dataclass(frozen=True)
class Case:
    """A damaged file of a kind, and the command that reads it."""

    seed: int
    number: int
    kind: Kind
    command: str
    content: bytes

    @property
    def name(self) -> str:
        """What the file is called where it is kept."""
        return f"{self.seed}-{self.number}-{self.kind.name}"

    def words(self, here: Path, good: Path) -> list[str]:
        """The command line: the damaged file and what is written lie in `here`, the good ones in `good`."""

        def word(text: str) -> str:
            if text.startswith("@"):
                return str(good / text[1:])
            if text == "FILE" or text.startswith("OUT."):
                return str(here / (self.kind.name if text == "FILE" else text.lower()))
            return text.replace("HERE", str(here))

        return [word(text) for text in self.command.split()]

    def write(self, here: Path) -> None:
        """The files of the case."""
        for name, content in {**self.kind.beside, self.kind.name: self.content}.items():
            (here / name).write_bytes(content)


def case(kinds: Sequence[Kind], seed: int, number: int) -> Case:
    """The case of this seed and number: every kind in turn."""
    rng = random.Random(f"{seed}-{number}")
    kind = kinds[number % len(kinds)]
    return Case(seed, number, kind, rng.choice(kind.commands), kind.wrapped(damaged(kind.good, rng)))


def good_cases(kinds: Sequence[Kind]) -> list[Case]:
    """Every command on the good file."""
    return [Case(0, 0, kind, command, kind.wrapped(kind.good)) for kind in kinds for command in kind.commands]
