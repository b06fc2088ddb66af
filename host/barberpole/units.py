"""The internal units, and the only conversions between them and others.

Everywhere inside: field µT, temperature °C, time s, current mA (platform current A), supply V, reading LSB.
Names carry the unit as their last part: `b_ut`, `temp_c`, `t_s`, `ix_ma`, `x_lsb`.
"""

import numpy as np

from barberpole.errors import InputError, must

UT_PER_GAUSS = 100.0
UT_PER_OERSTED = 100.0  # in air, where 1 Oe of H is 1 G of B
NT_PER_UT = 1000.0
US_PER_S = 1e6

NAMES = {"ut": "µT", "c": "°C", "s": "s", "ma": "mA", "a": "A", "v": "V", "lsb": "LSB"}
"""How a unit suffix is written for people."""

FIELD = ("gauss", "g", "mg", "oe", "pt", "nt", "ut", "µt", "mt", "t", "tesla")
READING = ("lsb", "raw", "count", "counts", "adc")
ELECTRIC = ("v", "mv", "uv", "a", "ma", "ua")
TEMPERATURE = ("c", "degc", "k", "f", "degf")
TIME = ("s", "sec", "ms", "us", "ns", "min", "h")
SUFFIXES = frozenset(FIELD + READING + ELECTRIC + TEMPERATURE + TIME)
"""Endings that are read as a unit, right or wrong, where a column name is checked."""

TO_OURS = {
    "ut": {"gauss": UT_PER_GAUSS, "g": UT_PER_GAUSS, "mg": 0.1, "oe": UT_PER_OERSTED}
    | {"pt": 1e-6, "nt": 1e-3, "ut": 1.0, "µt": 1.0, "mt": 1e3, "t": 1e6, "tesla": 1e6},
    "s": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    "ma": {"a": 1e3, "ma": 1.0, "ua": 1e-3},
    "a": {"a": 1.0, "ma": 1e-3, "ua": 1e-6},
    "v": {"v": 1.0, "mv": 1e-3, "uv": 1e-6},
    "c": {"c": 1.0, "degc": 1.0, "k": 1.0, "f": 5.0 / 9.0, "degf": 5.0 / 9.0},
}
"""Of each of our units, by which other units are multiplied; temperatures are shifted first."""
ZERO_C = {"k": 273.15, "f": 32.0, "degf": 32.0}
"""What 0 °C is in other units."""


def unit_of(unit: str, column: str) -> str:
    """The unit as `TO_OURS` knows it. Raises InputError where a column of a log cannot be given in it."""
    known = TO_OURS.get(column.rpartition("_")[2], {})
    if unit.lower() not in known:
        wanted = f"one of {', '.join(known)}" if known else f"not given for {column}, which is taken as it is"
        raise InputError(must("the unit after : in --take", wanted, repr(unit)))
    return unit.lower()


def other_unit(values: np.ndarray, column: str, unit: str) -> np.ndarray:
    """Values given in `unit` ("": ours) in the unit of the log's column."""
    if not unit:
        return values
    return (values - ZERO_C.get(unit, 0.0)) * TO_OURS[column.rpartition("_")[2]][unit]


def gauss_to_ut(field_gauss: float) -> float:
    """Field in µT from gauss."""
    return field_gauss * UT_PER_GAUSS


def ut_to_nt(field_ut: float) -> float:
    """Field in nT from µT."""
    return field_ut * NT_PER_UT
