"""The internal units, and the only conversions between them and others.

Everywhere inside: field µT, temperature °C, time s, current mA (platform current A), supply V, reading LSB.
Names carry the unit as their last part: `b_ut`, `temp_c`, `t_s`, `ix_ma`, `x_lsb`.
"""

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


def gauss_to_ut(field_gauss: float) -> float:
    """Field in µT from gauss."""
    return field_gauss * UT_PER_GAUSS


def ut_to_nt(field_ut: float) -> float:
    """Field in nT from µT."""
    return field_ut * NT_PER_UT
