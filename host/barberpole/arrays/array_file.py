"""boards/arrays/<array>.toml: which sensors are on one board, where, and the board itself.

[array] says what the host needs for the logs of any array. With the tables of a board file beside it, an emulated or
real board is built from the same file: name, sensor and shielded of [board] are those of [array].

The docstring under each field gives its unit and meaning.
"""

import re
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass

from barberpole import paths
from barberpole.board import Board, board_of, find_file, load_sensor
from barberpole.board_checks import check_board
from barberpole.board_tables import Member
from barberpole.errors import InputError, must
from barberpole.sensor import Sensor
from barberpole.tables import STRICT, Name, Yes, read_toml, validate

NAME = re.compile(r"[a-z][a-z0-9]*")  # of a sensor: it begins the names of columns
SAID = ("name", "sensor", "shielded")  # of a board, by [array]


@dataclass(frozen=True, config=STRICT)
class Array:
    """An array of equal sensors, their offset coils in series."""

    name: Name
    """Name of the file without .toml."""
    sensor: str
    """Name of a sensor file."""
    shielded: Yes
    """Whether coil runs are made in a magnetic shield, so that they give the biases too."""
    sensors: Annotated[tuple[Member, ...], Field(min_length=2)]
    """The sensors."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the sensors, in order."""
        return tuple(member.name for member in self.sensors)

    @property
    def kind(self) -> Sensor:
        """What sensors they are."""
        return load_sensor(self.sensor)

    def baseline_m(self, first: str, second: str) -> np.ndarray:
        """From one sensor to another, (3,) in m."""
        places = {member.name: np.asarray(member.position_mm) for member in self.sensors}
        return 1e-3 * (places[second] - places[first])


def load_array(name_or_path: str | Path) -> Array:
    """An array by name ("gradiometer") or path, whatever its board. Raises InputError."""
    return _read(name_or_path)[0]


def load_array_board(name_or_path: str | Path) -> Board:
    """The board of an array, its sensors as `members`. Raises InputError or LimitError."""
    board = read_array_board(name_or_path)
    check_board(board, find_file(name_or_path, paths.boards() / "arrays", "array"))
    return board


def read_array_board(name_or_path: str | Path) -> Board:
    """The same, well-formed, whatever it asks of its parts. Raises InputError."""
    array, tables, path = _read(name_or_path)
    head = tables.get("board")
    if not isinstance(head, dict):
        raise InputError(must("the array file", "one with the tables of a board", "[array] alone", path))
    for key in SAID:
        if key in head:
            raise InputError(must(f"board.{key}", "left to [array]", repr(head[key]), path))
    said = {key: getattr(array, key) for key in SAID}
    return board_of({**tables, "board": {**head, **said}}, path, array.sensors)


def _read(name_or_path: str | Path) -> tuple[Array, dict[str, Any], Path]:
    """The array, the file's other tables, and the file."""
    path = find_file(name_or_path, paths.boards() / "arrays", "array")
    tables = read_toml(path, "the array file")
    head = tables.pop("array", None)
    if not isinstance(head, dict):
        raise InputError(must("the array file", "one with a table [array]", ", ".join(tables) or "nothing", path))
    content = dict(head)
    listed = content.get("sensors")
    if isinstance(listed, list):
        content["sensors"] = [validate(Member, one, "the array file", path, "array.sensors.") for one in listed]
    array = validate(Array, content, "the array file", path, "array.")
    _check(array, path)
    return array, tables, path


def _check(array: Array, path: Path) -> None:
    load_sensor(array.sensor)
    for name in array.names:
        if not NAME.fullmatch(name):
            raise InputError(
                must("the name of a sensor", "of small letters and digits, a letter first", repr(name), path)
            )
    if len(set(array.names)) < len(array.names):
        raise InputError(must("the sensors", "of different names", ", ".join(array.names), path))
    places = {member.position_mm for member in array.sensors}
    if len(places) < len(array.sensors):
        raise InputError(must("the sensors", "at different places", "two at one", path))
