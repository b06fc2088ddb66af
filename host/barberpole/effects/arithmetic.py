"""A number that knows + - * / and sqrt and nothing else, to find out whether a formula needs more than that."""

from dataclasses import dataclass
from typing import Any


def _value(other: Any) -> float:
    return other.value if isinstance(other, Bare) else float(other)


@dataclass(frozen=True, eq=False)
class Bare:
    """Has no truth value, no order, no conversion: what runs on it, the firmware generator can trace."""

    value: float

    def sqrt(self) -> "Bare":
        """What np.sqrt calls."""
        return Bare(self.value**0.5)

    def __bool__(self) -> bool:
        raise TypeError("a symbol is neither true nor false")

    def __neg__(self) -> "Bare":
        return Bare(-self.value)

    def __add__(self, other: Any) -> "Bare":
        return Bare(self.value + _value(other))

    def __mul__(self, other: Any) -> "Bare":
        return Bare(self.value * _value(other))

    def __sub__(self, other: Any) -> "Bare":
        return Bare(self.value - _value(other))

    def __rsub__(self, other: Any) -> "Bare":
        return Bare(_value(other) - self.value)

    def __truediv__(self, other: Any) -> "Bare":
        return Bare(self.value / _value(other))

    def __rtruediv__(self, other: Any) -> "Bare":
        return Bare(_value(other) / self.value)

    __radd__, __rmul__ = __add__, __mul__
