"""TOML tables into frozen dataclasses, checked once by pydantic, with one readable sentence when something is wrong."""

import dataclasses
import difflib
import re
import tomllib
import typing
from pathlib import Path
from typing import Annotated, Any

from pydantic import ConfigDict, Field, Strict, TypeAdapter, ValidationError

from barberpole.errors import InputError, must
from barberpole.files import read_text

STRICT = ConfigDict(extra="forbid", use_attribute_docstrings=True)
"""For everything read from a file: no unknown key; the docstrings under fields say unit and meaning."""

Number = Annotated[float, Strict(), Field(allow_inf_nan=False)]
Integer = Annotated[int, Strict()]
Yes = Annotated[bool, Strict()]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
Fraction = Annotated[Number, Field(gt=0, lt=1)]
Count = Annotated[Integer, Field(gt=0)]
Index = Annotated[Integer, Field(ge=0)]
"""A number is not taken from quotes, a whole number not from a fraction, a truth not from 0 or 1."""

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.+-]{0,63}$")]
"""What a board, a sensor or an array is called. It becomes part of file names and of generated programs."""
_NAME = "a name of at most 64 letters (a-z), digits, _, ., + or -"

_UNKNOWN = frozenset({"unexpected_keyword_argument", "extra_forbidden"})
_MISSING = frozenset({"missing", "missing_argument"})


def read_toml(path: str | Path, what: str) -> dict[str, Any]:
    """Parsed TOML of a file. `what` names it in errors ("the board file"). Raises InputError."""
    try:
        return tomllib.loads(read_text(path, what))
    except ValueError as error:  # a number of more digits than Python takes is one too
        raise InputError(must(what, "valid TOML", str(error).partition(";")[0], path)) from None
    except RecursionError:
        raise InputError(must(what, "valid TOML", "brackets within brackets, too deep to read", path)) from None


T = typing.TypeVar("T")


def validate(kind: type[T], data: dict[str, Any], what: str, where: object = "", prefix: str = "") -> T:
    """`data` as the dataclass `kind`. Raises InputError about one fault, a key that is not known before all others.

    what    names the data in the error ("the board file"); where says which one
    prefix  stands before the keys of the top level ("board.")
    """
    try:
        return TypeAdapter(kind).validate_python(data)
    except ValidationError as error:
        fault = min(error.errors(), key=lambda fault: fault["type"] not in _UNKNOWN)
        raise InputError(_sentence(kind, fault, what, where, prefix)) from None


def closest(name: str, known: typing.Iterable[str]) -> str | None:
    """The known name probably meant by `name`: the same quantity in another unit, else the nearest spelling."""
    known = list(known)
    stem = name.rpartition("_")[0]
    same = [k for k in known if stem and k.rpartition("_")[0] == stem]
    return same[0] if same else next(iter(difflib.get_close_matches(name, known, n=1, cutoff=0.5)), None)


def unknown(name: str, known: typing.Iterable[str], what: str, where: object, prefix: str = "") -> str:
    """The sentence about a key that is not known, with the one probably meant."""
    known = sorted(known)
    near = closest(name, known)
    hint = f"closest: {prefix}{near}" if near else f"known: {', '.join(known)}"
    return must(what, f"made of known keys ({hint})", prefix + name, where)


def describe(kind: type, name: str) -> str:
    """Unit and meaning of a field, as its docstring says."""
    fields = getattr(kind, "__pydantic_fields__", {})
    return (fields[name].description or "") if name in fields else ""


def table_of(kind: type, name: str) -> type | None:
    """The dataclass that a field holds, None where it holds a value."""
    hint = typing.get_type_hints(kind).get(name)
    choices = [hint, *typing.get_args(hint)]  # `Table | None` is a table that may be absent
    return next((c for c in choices if isinstance(c, type) and dataclasses.is_dataclass(c)), None)


def _sentence(kind: type, fault: Any, what: str, where: object, prefix: str) -> str:
    path = list(fault["loc"])
    table, start = kind, prefix
    while len(path) > 1 and (inner := table_of(table, str(path[0]))):
        start = f"{path.pop(0)}." if table is kind else f"{start}{path.pop(0)}."
        table = inner
    key, item = str(path[0]), "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path[1:])
    if fault["type"] in _UNKNOWN and not item:
        return unknown(key, [f.name for f in dataclasses.fields(table)], what, where, start)
    if fault["type"] in _MISSING and table_of(table, key):
        return must(what, f"one with a table [{key}]", "none", where)
    if fault["type"] in _MISSING:
        meaning = describe(table, key).rstrip(".")
        return must(start + key + item, f"given ({meaning})" if meaning else "given", "nothing", where)
    return must(start + key + item, _expected(fault["msg"]), repr(fault["input"]), where)


def _expected(message: str) -> str:
    """What pydantic expects, as the end of "must be"."""
    if message.startswith("String should match pattern"):
        return _NAME
    wanted = message.removeprefix("Input should be ").removeprefix("Value error, ")
    return re.sub(r"^\w+ should have (.*) after validation.*", r"of \1", wanted)
