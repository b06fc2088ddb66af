"""An array's calibration as TOML and back; floats come back exactly."""

from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from barberpole.arrays.calibrate import OfArray
from barberpole.errors import InputError, must
from barberpole.files import write_atomic
from barberpole.methods.offset_coil import Affine
from barberpole.tables import read_toml

FORMAT = 1


def write_array(found: OfArray, array: str, path: Path) -> None:
    """Write it, whole or not at all."""
    document = tomlkit.document()
    document.add(tomlkit.comment("barberpole array: H = matrix h + bias of each sensor, µT from LSB, in one frame"))
    document["format"] = FORMAT
    document["array"] = array
    document["sensor"] = {name: _sensor(found, name) for name in found.affine}
    write_atomic(path, tomlkit.dumps(document))


def read_array(path: Path, names: tuple[str, ...]) -> OfArray:
    """Read it. Raises InputError where it is none, or of other sensors than `names`."""
    tables = read_toml(path, "the array's calibration")
    sensors = tables.get("sensor")
    if tables.get("format") != FORMAT or not isinstance(sensors, dict):
        raise InputError(must("the array's calibration", "as `barberpole array` wrote it", "another form", path))
    if set(sensors) != set(names):
        raise InputError(must("the array's calibration", f"of {', '.join(names)}", ", ".join(sensors), path))
    try:
        return OfArray(
            {n: _affine(sensors[n], "matrix", "bias_ut") for n in names},
            {n: _affine(sensors[n], "sc_sigma_c", "bc_ut") for n in names if "sc_sigma_c" in sensors[n]},
            {n: _shaped(sensors[n]["gain"], 3) for n in names},
            {n: float(sensors[n]["left_ut"]) for n in names if "left_ut" in sensors[n]},
        )
    except (KeyError, ValueError, TypeError, OverflowError):
        raise InputError(must("the array's calibration", "as `barberpole array` wrote it", "a gap", path)) from None


def _sensor(found: OfArray, name: str) -> dict[str, Any]:
    affine = found.affine[name]
    table: dict[str, Any] = {
        "matrix": affine.a.tolist(),
        "bias_ut": affine.b.tolist(),
        "gain": found.gain[name].tolist(),
    }
    if name in found.carried:
        table |= {"sc_sigma_c": found.carried[name].a.tolist(), "bc_ut": found.carried[name].b.tolist()}
    return table | ({"left_ut": found.left_ut[name]} if name in found.left_ut else {})


def _affine(table: dict[str, Any], matrix: str, bias: str) -> Affine:
    return Affine(_shaped(table[matrix], 3, 3), _shaped(table[bias], 3))


def _shaped(values: Any, *shape: int) -> np.ndarray:
    """An array of this shape. Raises ValueError or TypeError where the values are none, or not numbers."""
    found = np.array(values, float)
    if found.shape != shape or not np.all(np.isfinite(found)):
        raise ValueError
    return found
