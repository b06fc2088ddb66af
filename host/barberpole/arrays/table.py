"""Fields and gradients of an array as a table: a_bx_ut.., grad_ab_x_nt_per_m.."""

from pathlib import Path

import numpy as np

from barberpole.arrays.gradient import Gradient
from barberpole.errors import InputError, must
from barberpole.files import write_atomic
from barberpole.log import Log
from barberpole.log_formats import write_csv, write_parquet


def write_fields(log: Log, fields: dict[str, np.ndarray], found: list[Gradient], path: Path) -> None:
    """Time, fields (3, n) in µT by sensor, gradients; .csv or .parquet. Raises InputError for another ending."""
    columns = {"t_s": log["t_s"]} if log.has("t_s") else {}
    for name, field in fields.items():
        columns |= {f"{name}_b{axis}_ut": field[i] for i, axis in enumerate("xyz")}
    for g in found:
        columns |= {f"grad_{g.first}{g.second}_{axis}_nt_per_m": g.nt_per_m[i] for i, axis in enumerate("xyz")}
    if path.suffix.lower() not in (".csv", ".parquet"):
        raise InputError(must("the output", "a file that ends in .csv or .parquet", repr(path.suffix), path))
    write_atomic(path, write_csv(columns) if path.suffix.lower() == ".csv" else write_parquet(columns, {}))
