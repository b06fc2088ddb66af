"""Good files of one sensor: logs in every format, its calibration, what its board and a coil driver stream."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from barberpole.calibrating import calibration_of
from barberpole.calibration import write_calibration
from barberpole.challenge.record import Recipe, record
from barberpole.columns import CURRENT, FIELD, READINGS
from barberpole.fit.fit import fit_log
from barberpole.log import Log, read_log, write_log
from barberpole.modelfile import read_model
from barberpole.records import POINT, encode, encode_json

Columns = dict[str, np.ndarray]

ROWS = 120
POINTS = 24
HELD_S = 0.1  # of a point of the coil driver
UT_PER_MA = (1.0, 1.1, 0.9)
HEADER: dict[str, Any] = {
    "format": 1,
    "board": "pybv11",
    "sensor": "hmc1021_1022",
    "columns": [["t_s", "f", 1.0], ["x_lsb", "f", 1.0], ["y_lsb", "f", 1.0], ["z_lsb", "f", 1.0], ["temp_c", "f", 1.0]],
    "polarity": "raw",
}
VERDICT: dict[str, Any] = {
    "accepted": True,
    "reasons": [0],
    "gain": [1.0, 1.0, 1.0],
    "gain_ut_per_unit": [[50.0, 0.0, 0.0], [0.0, 50.0, 0.0], [0.0, 0.0, 50.0]],
    "ambient_ut": [20.0, -30.0, 35.0],
    "residual_ut": [0.01, 0.01, 0.01],
    "ambient_step_ut": 0.0,
    "temp_c": 25.0,
    "duration_s": 2.0,
    "in_force": "slot a",
    "seq": 1,
    "shielded": False,
}
DRIVER: dict[str, Any] = {
    "format": 1,
    "role": "coil_driver",
    "board": "imcs_driver",
    "ut_per_ma": UT_PER_MA,
    "columns": [[name, "q", 1e-6] for name in ("t_s", "from_s", "to_s")] + [[name, "f", 1.0] for name in CURRENT],
}


def turned(seed: int, least_ut: float = 40.0, most_ut: float = 60.0, rows: int = ROWS) -> tuple[Columns, np.ndarray]:
    """A short log of a board turned through all directions, and the field (3, rows) in µT."""
    rng = np.random.default_rng(seed)
    field = rng.normal(size=(3, rows))
    field *= rng.uniform(least_ut, most_ut, rows) / np.linalg.norm(field, axis=0)
    return _read(rng, field, np.arange(rows) / 40.0), field


def still(seed: int, rows: int = 400) -> Columns:
    """The same board at rest."""
    rng = np.random.default_rng(seed)
    return _read(rng, np.tile([[20.0], [-30.0], [35.0]], rows), np.arange(rows) / 40.0)


def _read(rng: np.random.Generator, field: np.ndarray, t_s: np.ndarray) -> Columns:
    angles = np.eye(3) + 0.02 * rng.normal(size=(3, 3))
    gain, bias = rng.normal(10.0, 0.5, (3, 1)), rng.normal(0.0, 30.0, (3, 1))
    y = gain * (angles @ field) + bias + 2.0 * rng.normal(size=field.shape)
    temp_c = 25.0 + 0.05 * rng.normal(size=t_s.size)
    return {"t_s": t_s, "temp_c": temp_c} | dict(zip(READINGS, np.round(y, 2), strict=True))


def write_logs(folder: Path, model: str) -> None:
    """field.csv and .parquet (the field known), turned.csv (only its magnitude), still.csv, pairs.csv, in_coils.csv;
    and the calibration good.toml."""
    known, field = turned(1)
    logs = {
        "field": known | dict(zip(FIELD, np.round(field, 3), strict=True)),
        "turned": turned(1, 50.0, 50.0)[0],
        "still": still(1),
        "pairs": record(Recipe({}, rows=80, form="pairs", seed=1)),
        "in_coils": _in_coils(),
    }
    for name, columns in logs.items():
        write_log(Log(columns, folder / f"{name}.csv", "0" * 64), folder / f"{name}.csv")
    good, file = read_log(folder / "field.csv"), read_model(model)
    write_log(good, folder / "field.parquet")
    write_calibration(calibration_of(fit_log(good, file), good, file), folder / "good.toml")


def records(folder: Path) -> Callable[[bytes], bytes]:
    """What a board streams after a header: rows, an event, a coil run."""
    columns = read_log(folder / "turned.csv").columns
    rows = np.stack([columns[name] for name, _, _ in HEADER["columns"]], axis=1).astype("<f4")
    out = [encode_json("E", 1, {"kind": "boot", "boot": 1})]
    out += [encode("D", 2 + at, row.tobytes()) for at, row in enumerate(rows)]
    out += [encode_json("T", 200, {"points": POINTS, "trajectory": "a", "unit_ma": [5.0, 5.0, 5.0], "block": 4})]
    out += [encode("P", 201 + at, point) for at, point in enumerate(_points())]
    body = b"".join([*out, encode_json("S", 220, VERDICT)])
    return lambda header: encode("H", 0, header) + body


def _points() -> list[bytes]:
    """A coil run, antipodal, in a field that stands still."""
    half = np.random.default_rng(4).uniform(-1.0, 1.0, (POINTS // 2, 3))
    units = np.stack([half, -half], axis=1).reshape(POINTS, 3)
    set_lsb = 10.0 * (50.0 * units + [20.0, -30.0, 35.0])
    return [
        POINT.pack(at, *u, *y, *(5.0 - y), *(5.0 * u), 25.0)
        for at, (u, y) in enumerate(zip(units, set_lsb, strict=True))
    ]


def _currents() -> np.ndarray:
    """(ROWS, 3) in mA, one after the other held."""
    return np.random.default_rng(2).uniform(-40.0, 40.0, (ROWS, 3))


def driver_records(header: bytes) -> bytes:
    """What a coil driver streams after a header: points that were held."""
    kind = np.dtype([("times", "<i8", 3), ("currents", "<f4", 3)])
    begin = (1e6 * HELD_S * np.arange(ROWS)).astype(int)
    times = np.stack([begin + 90_000, begin + 10_000, begin + 90_000], axis=1)
    rows = [np.array((t, i), kind).tobytes() for t, i in zip(times, _currents(), strict=True)]
    return b"".join([encode("H", 0, header), *(encode("D", 1 + at, row) for at, row in enumerate(rows))])


def _in_coils() -> Columns:
    """A sensor's log in those coils, its clock a little behind."""
    t_s = np.arange(0.0, HELD_S * (ROWS - 11), 0.02)
    field = (_currents() * UT_PER_MA)[((t_s + 1.0) // HELD_S).astype(int)].T
    return _read(np.random.default_rng(3), field, t_s)


def header_text(header: dict[str, Any]) -> bytes:
    """A header frame's JSON."""
    return json.dumps(header).encode()
