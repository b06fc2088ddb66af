"""Good files of every kind that barberpole reads, small, and the commands that read them."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from barberpole.calibrating import calibration_of
from barberpole.calibration import write_calibration
from barberpole.challenge.record import Recipe, record
from barberpole.fit.fit import fit_log
from barberpole.log import Log, read_log, write_log
from barberpole.modelfile import read_model
from barberpole.paths import boards
from barberpole.plugins import TEMPLATE
from barberpole.records import POINT, encode, encode_json

ROWS = 80
MODEL = """effects = ["bias", "scale", "misalignment"]
reference = { magnitude_ut = 50.0, temp_c = 25.0 }
sensor = "hmc1021_1022"
plugins = []

[cross_field]
form = "each"
"""
LINEAR = "bias,scale,misalignment"


@dataclass(frozen=True)
class Kind:
    """One kind of file: its name, a good one, and command lines in which FILE stands for it, GOOD for a good log.

    wrapped: what is put around the damaged part, so that no checksum catches the damage.
    """

    name: str
    good: bytes
    commands: tuple[str, ...]
    wrapped: Callable[[bytes], bytes] = bytes


def kinds(folder: Path) -> list[Kind]:
    """All kinds; the good files lie in `folder`."""
    columns = record(Recipe({}, rows=ROWS, form="demodulated", seed=1))
    log = Log(columns, folder / "good.csv", "0" * 64)
    write_log(log, log.path)
    write_log(log, folder / "good.parquet")
    good = read_log(log.path)
    file = read_model(LINEAR)
    write_calibration(calibration_of(fit_log(good, file), good, file), folder / "good.toml")
    (folder / "good_plugin.py").write_text(TEMPLATE.read_text().replace("NAME", "mine"))
    header, sensor = json.dumps(HEADER).encode(), (boards() / "sensors" / "hmc1021_1022.toml").read_bytes()
    return [
        Kind("log.csv", log.path.read_bytes(), LOG),
        Kind("log.parquet", (folder / "good.parquet").read_bytes(), LOG[:3]),
        Kind("log.bpr", records(columns, header), BOARD_LOG),
        Kind("header.bpr", header, BOARD_LOG, partial(records, columns)),
        Kind("board.toml", (boards() / "pybv11.toml").read_bytes(), ("board check FILE",)),
        Kind("sensor.toml", sensor, (f"fit GOOD --model {LINEAR} --sensor FILE",)),
        Kind("model.toml", MODEL.encode(), ("fit GOOD --model FILE --json", "remove scale GOOD --model FILE")),
        Kind("calibration.toml", (folder / "good.toml").read_bytes(), ("verify GOOD --calibration FILE --json",)),
        Kind("mine.py", (folder / "good_plugin.py").read_bytes(), ("fit GOOD --model PLUGGED --json",)),
    ]


LOG = (
    f"fit FILE --model {LINEAR} --json",
    "convert FILE -o OUT.csv",
    "fit FILE --method ellipsoid",
    f"compare FILE --model {LINEAR}",
    "summary FILE",
    f"fit FILE --model {LINEAR},cross_field,drift,outliers",
)


BOARD_LOG = (*LOG[:3], "verify FILE --calibration GOODCAL --json", "summary FILE")
HEADER: dict[str, Any] = {
    "format": 1,
    "board": "pybv11",
    "sensor": "hmc1021_1022",
    "columns": [["t_s", "f", 1.0], ["x_lsb", "f", 1.0], ["y_lsb", "f", 1.0], ["z_lsb", "f", 1.0], ["temp_c", "f", 1.0]],
    "polarity": "raw",
}


def records(columns: dict[str, np.ndarray], header: bytes) -> bytes:
    """What a board streams: a header, rows, an event, a coil run."""
    out = [encode("H", 0, header), encode_json("E", 1, {"kind": "boot", "boot": 1})]
    rows = np.stack([columns[name] for name, _, _ in HEADER["columns"]], axis=1).astype("<f4")
    out += [encode("D", 2 + at, row.tobytes()) for at, row in enumerate(rows)]
    out += [encode_json("T", 100, {"points": 12, "trajectory": "a", "unit_ma": 5.0})]
    out += [encode("P", 101 + at, POINT.pack(at, *np.arange(13.0))) for at in range(12)]
    return b"".join([*out, encode_json("S", 120, {"pass": True})])
