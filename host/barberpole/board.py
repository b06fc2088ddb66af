"""What is soldered: boards/<board>.toml and boards/sensors/<sensor>.toml, read and checked.

board = load_board("pybv11")
board.flip.pulse_us, board.sensor.bridge_ohm, board.scale_lsb_per_ut
"""

from pathlib import Path
from typing import Any

from barberpole import paths
from barberpole.board_checks import check_board
from barberpole.board_tables import Board, Member
from barberpole.errors import InputError, must
from barberpole.sensor import Sensor
from barberpole.tables import closest, read_toml, unknown, validate

__all__ = ["Board", "Sensor", "load_board", "load_sensor", "read_board"]

TABLES = ("flip", "adc", "dac", "coils", "selfcal", "timing")


def load_board(name_or_path: str | Path) -> Board:
    """A board by name ("pybv11") or path, with its sensor. Raises InputError or LimitError."""
    board = read_board(name_or_path)
    check_board(board, find_file(name_or_path, paths.boards(), "board"))
    return board


def read_board(name_or_path: str | Path) -> Board:
    """A board that is well-formed, whatever it asks of its parts. Raises InputError."""
    path = find_file(name_or_path, paths.boards(), "board")
    return board_of(read_toml(path, "the board file"), path)


def board_of(tables: dict[str, Any], path: Path, members: tuple[Member, ...] = ()) -> Board:
    """The board of a file's tables; members: the sensors of an array. Raises InputError."""
    head = tables.pop("board", None)
    if not isinstance(head, dict):
        raise InputError(must("the board file", "one with a table [board]", "none", path))
    if head.get("role", "sensor") != "sensor":
        raise InputError(must("the board file", "one of a sensor board", f"the role {head['role']!r}", path))
    _only_tables(tables, path)
    sensor = head.get("sensor")
    if not isinstance(sensor, str):
        raise InputError(must("board.sensor", "the name of a sensor file", repr(sensor), path))
    content = {**head, **tables, "sensor": load_sensor(_beside(path, sensor)), "members": members}
    return validate(Board, content, "the board file", path, "board.")


def load_sensor(name_or_path: str | Path) -> Sensor:
    """A sensor by name ("hmc1021_1022") or path. Raises InputError."""
    path = find_file(name_or_path, paths.boards() / "sensors", "sensor")
    tables = read_toml(path, "the sensor file")
    if set(tables) != {"sensor"} or not isinstance(tables["sensor"], dict):
        raise InputError(must("the sensor file", "one table [sensor]", ", ".join(tables) or "nothing", path))
    return validate(Sensor, tables["sensor"], "the sensor file", path, "sensor.")


def _only_tables(tables: dict[str, Any], path: Path) -> None:
    for name in tables:
        if name not in TABLES:
            raise InputError(unknown(name, ("board", *TABLES), "the board file", path))


def _beside(path: Path, sensor: str) -> str | Path:
    """A sensor given as a .toml path is meant relative to the board file."""
    return path.parent / sensor if sensor.endswith(".toml") else sensor


def find_file(name_or_path: str | Path, folder: Path, what: str) -> Path:
    """The file of a name in `folder`, or a .toml path as it is. Raises InputError with the closest name."""
    if str(name_or_path).endswith(".toml"):
        return Path(name_or_path)
    known = sorted(path.stem for path in folder.glob("*.toml"))
    if str(name_or_path) in known:
        return folder / f"{name_or_path}.toml"
    near = closest(str(name_or_path), known)
    hint = f"closest: {near}; " if near else ""
    raise InputError(
        must(f"the {what}", f"a .toml file or one of {', '.join(known)}", f"{name_or_path!r}", hint.rstrip("; "))
    )
