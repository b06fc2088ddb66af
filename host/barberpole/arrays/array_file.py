"""boards/arrays/<array>.toml: which sensors are on one board, and where.

The docstring under each field gives its unit and meaning.
"""

import re
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass

from barberpole import paths
from barberpole.board import find_file, load_sensor
from barberpole.errors import InputError, must
from barberpole.sensor import Sensor
from barberpole.tables import STRICT, Number, Yes, read_toml, validate

NAME = re.compile(r"[a-z][a-z0-9]*")  # of a sensor: it begins the names of columns


@dataclass(frozen=True, config=STRICT)
class Member:
    """One sensor of the array."""

    name: str
    """Name, with which its columns begin."""
    position_mm: tuple[Number, Number, Number]
    """mm. Where it is, in the frame of the board."""


@dataclass(frozen=True, config=STRICT)
class Array:
    """An array of equal sensors, their offset coils in series."""

    name: str
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
    """An array by name ("gradiometer") or path. Raises InputError."""
    path = find_file(name_or_path, paths.boards() / "arrays", "array")
    tables = read_toml(path, "the array file")
    if set(tables) != {"array"} or not isinstance(tables["array"], dict):
        raise InputError(must("the array file", "one table [array]", ", ".join(tables) or "nothing", path))
    content = dict(tables["array"])
    listed = content.get("sensors")
    if isinstance(listed, list):
        content["sensors"] = [validate(Member, one, "the array file", path, "array.sensors.") for one in listed]
    array = validate(Array, content, "the array file", path, "array.")
    _check(array, path)
    return array


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
