"""The published methods by name, beside the general fit."""

from collections.abc import Callable

from barberpole.errors import InputError, must
from barberpole.methods.scalar import ellipsoid

METHODS: dict[str, Callable] = {"ellipsoid": ellipsoid}


def find_method(name: str) -> Callable:
    """The method of that name. Raises InputError with the known names."""
    if name not in METHODS:
        raise InputError(must("the method", f"one of {', '.join(METHODS)}", repr(name)))
    return METHODS[name]
