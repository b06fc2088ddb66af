"""What the JSON of a board's frames must look like: a board's word is data too, and is checked once, where it is read.

Keys that are not listed are kept as they are; of those listed none needs to be there.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from barberpole.errors import InputError, must

CODES = {"b": "i1", "B": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4", "q": "<i8", "f": "<f4", "d": "<f8"}
LARGEST = 1e30  # no quantity of ours comes near; a whole number in JSON may be too long for a float

Check = Callable[[Any], bool]


def _text(value: Any) -> bool:
    return isinstance(value, str)


def _yes(value: Any) -> bool:
    return isinstance(value, bool)


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not _yes(value) and -LARGEST < value < LARGEST


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not _yes(value) and abs(value) < 1 << 31


def _count(value: Any) -> bool:
    return _whole(value) and value >= 0


def _table(value: Any) -> bool:
    return isinstance(value, dict)


def _triple(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(map(_number, value))


def _matrix(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(map(_triple, value))


def _codes(value: Any) -> bool:
    return isinstance(value, list) and all(map(_count, value))


def _hash(value: Any) -> bool:  # of an array one for each sensor
    return _text(value) or (isinstance(value, list) and all(map(_text, value)))


def _columns(value: Any) -> bool:
    rows = isinstance(value, list) and all(isinstance(one, list) and len(one) == 3 for one in value)
    return rows and all(_text(name) and _text(code) and code in CODES and _number(s) for name, code, s in value)


TEXT, YES, NUMBER = (_text, "text"), (_yes, "true or false"), (_number, "a number")
WHOLE, COUNT, TABLE = (_whole, "a whole number"), (_count, "a whole number from 0"), (_table, "a table")
TRIPLE, MATRIX = (_triple, "three numbers"), (_matrix, "three rows of three numbers")
CODE_LIST, HASH = (_codes, "a list of whole numbers"), (_hash, "text")
COLUMNS = (_columns, "a list of [name, struct code, scale]")

KNOWN: dict[str, dict[str, tuple[Check, str]]] = {
    "H": {
        **dict.fromkeys(("board", "sensor", "firmware", "uid", "role", "polarity"), TEXT),
        **dict.fromkeys(("model", "calibration"), HASH),
        "boot": WHOLE,
        "columns": COLUMNS,
        "ut_per_ma": TRIPLE,
    },
    "T": {"trajectory": TEXT, "points": COUNT, "block": COUNT, "unit_ma": TRIPLE, "t_s": NUMBER},
    "E": {"t_s": NUMBER, "code": COUNT, "name": TEXT, "text": TEXT, "values": TABLE},
    "S": {
        **dict.fromkeys(("accepted", "shielded"), YES),
        **dict.fromkeys(("gain", "in_force_gain", "ambient_ut", "offset_lsb", "residual_ut"), TRIPLE),
        **dict.fromkeys(("ambient_step_ut", "temp_c", "duration_s"), NUMBER),
        "gain_ut_per_unit": MATRIX,
        "in_force": TEXT,
        "reasons": CODE_LIST,
        "seq": COUNT,
        "sensors": TABLE,
    },
    "A": {"command": TEXT, "done": YES},
}
"""By type of frame: what its keys hold, and how that is called."""


def fault(kind: str, content: dict[str, Any], where: object = "") -> str:
    """What is wrong with the JSON of a frame of this type, as one sentence; '' if nothing."""
    for key, (fits, wanted) in KNOWN[kind].items():
        if key in content and not fits(content[key]):
            return must(f"the board record's {NAMES[kind]} {key}", wanted, repr(content[key])[:SHOWN], where)
    return ""


NAMES = {"H": "header", "T": "coil run", "E": "event", "S": "verdict", "A": "answer"}
SHOWN = 60  # characters of what was got


def layout_of(header: dict[str, Any]) -> np.dtype | None:
    """How a row of the header's columns lies in a frame; None where it says none, or one name twice."""
    columns = header.get("columns") or []
    names = [name for name, _, _ in columns]
    if not names or not all(names) or len(set(names)) < len(names):
        return None
    return np.dtype([(name, CODES[code]) for name, code, _ in columns])


def checked_meta(meta: Any, where: object) -> dict[str, Any]:
    """What a log says of its board, with `result` and `events` as its frames said them. Raises InputError."""
    if not isinstance(meta, dict):
        raise InputError(must("the log's metadata", "a table", type(meta).__name__, where))
    result, events = meta.get("result"), meta.get("events", [])
    if not (result is None or _table(result)) or not (isinstance(events, list) and all(map(_table, events))):
        raise InputError(must("the log's metadata", "as `barberpole convert` wrote it", "another content", where))
    parts = [("H", meta), *([("S", result)] if result else []), *(("E", event) for event in events)]
    for kind, content in parts:
        if said := fault(kind, content, where):
            raise InputError(said)
    return meta
