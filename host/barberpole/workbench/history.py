"""The path of attempts: a tree of steps, one of them current. Nothing tried is ever lost."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from barberpole.workbench.bench import Bench


@dataclass(frozen=True)
class Step:
    """One attempt. Errors in LSB; None until they are known."""

    label: str
    bench: Bench
    parent: int | None = None
    rms_lsb: float | None = None
    heldout_lsb: float | None = None


@dataclass(frozen=True)
class History:
    """steps in the order in which they were made; `at` is the current one, `ahead` what redo goes to, nearest first."""

    steps: tuple[Step, ...]
    at: int = 0
    ahead: tuple[int, ...] = ()

    @classmethod
    def begin(cls, bench: Bench, label: str = "start") -> "History":
        return cls((Step(label, bench),))

    @property
    def now(self) -> Step:
        return self.steps[self.at]

    def do(self, label: str, bench: Bench) -> "History":
        """One step on from the current one. A step that leads to where a child of it is already goes there."""
        for at, step in enumerate(self.steps):
            if step.parent == self.at and step.bench == bench:
                return replace(self, at=at, ahead=())
        return History((*self.steps, Step(label, bench, self.at)), len(self.steps))

    def measured(self, rms_lsb: float, heldout_lsb: float, at: int | None = None) -> "History":
        """The errors of a step (the current one), once they are known."""
        steps, at = list(self.steps), self.at if at is None else at
        steps[at] = replace(steps[at], rms_lsb=rms_lsb, heldout_lsb=heldout_lsb)
        return replace(self, steps=tuple(steps))

    def undo(self) -> "History":
        """One step back; at the start, nothing."""
        parent = self.now.parent
        return self if parent is None else replace(self, at=parent, ahead=(self.at, *self.ahead))

    def redo(self) -> "History":
        """The step last undone; without one, nothing."""
        return replace(self, at=self.ahead[0], ahead=self.ahead[1:]) if self.ahead else self

    def go(self, at: int) -> "History":
        """Any step. The way back along it stays open to redo."""
        trail = self.trail()
        if at in trail:
            return replace(self, at=at, ahead=(*trail[trail.index(at) + 1 :], *self.ahead))
        return replace(self, at=at, ahead=())

    def trail(self) -> list[int]:
        """Steps from the start to the current one."""
        trail, at = [self.at], self.now.parent
        while at is not None:
            trail.append(at)
            at = self.steps[at].parent
        return trail[::-1]

    def path(self) -> list[int]:
        """The trail and what redo leads on to."""
        return [*self.trail(), *self.ahead]

    def tree(self, parent: int | None = None, depth: int = 0) -> Iterator[tuple[int, int]]:
        """(depth, step) of every step, children after their parents; only a fork goes deeper."""
        children = [at for at, step in enumerate(self.steps) if step.parent == parent]
        for number, at in enumerate(children):
            inner = depth + (number < len(children) - 1)
            yield inner, at
            yield from self.tree(at, inner)
