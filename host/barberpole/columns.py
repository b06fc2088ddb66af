"""The columns of a log: names, units, which belong together. Names carry the unit as their last part."""

from collections.abc import Iterable, Sequence

from barberpole import units
from barberpole.errors import InputError, must

READINGS = ("x_lsb", "y_lsb", "z_lsb")
SET = ("x_set_lsb", "y_set_lsb", "z_set_lsb")
RESET = ("x_reset_lsb", "y_reset_lsb", "z_reset_lsb")
FIELD = ("bx_ut", "by_ut", "bz_ut")
CURRENT = ("ix_ma", "iy_ma", "iz_ma")
COMPENSATED = ("cx_ut", "cy_ut", "cz_ut")
TRIPLES = (READINGS, SET, RESET, FIELD, CURRENT, COMPENSATED)
SINGLES = ("t_s", "state", "b_ut", "temp_c", "load_a", "supply_v")
KNOWN = frozenset(SINGLES).union(*TRIPLES)

OTHER_TABLES = "`barberpole convert --take` makes a log of another table"
MANY = 10  # names that a message lists

_UNIT_OF = {stem: unit for stem, _, unit in (name.rpartition("_") for name in KNOWN) if stem}


def check_names(names: Sequence[str], where: object, readings: bool = True) -> None:
    """Raise InputError about a name that is empty, there twice, in a wrong unit, or without its two companions.

    readings: whether there must be any; the record of a coil driver has none.
    """
    seen: set[str] = set()
    for number, name in enumerate(names, start=1):
        if not name:
            raise InputError(must(f"column {number}", "named", "no name", where))
        if not name.isprintable():
            raise InputError(must(f"the name of column {number}", "of printable characters", repr(name), where))
        if name in seen:
            raise InputError(must(f"column {name}", "there once", "it twice", where))
        seen.add(name)
        _check_unit(name, where)
    for triple in TRIPLES:
        _check_complete(triple, seen, where)
    if readings:
        _check_readings(seen, where)


def unknown(names: Iterable[str]) -> tuple[str, ...]:
    """Columns that are kept but mean nothing to barberpole."""
    return tuple(name for name in names if name not in KNOWN)


def listed(names: Sequence[str]) -> str:
    """Names for a message, which a file of another kind may fill with anything."""
    short = [name if len(name) <= 2 * MANY else f"{name[: 2 * MANY]}..." for name in names[:MANY]]
    return ", ".join(short) + (f" and {len(names) - MANY} more" if len(names) > MANY else "")


def _check_unit(name: str, where: object) -> None:
    lower = name.lower()
    if lower in KNOWN and name != lower:
        raise InputError(must(f"column {name}", f"written {lower}", name, where))
    stem, _, suffix = lower.rpartition("_")
    expected = _UNIT_OF.get(stem)
    if expected and suffix in units.SUFFIXES and suffix != expected:
        unit = units.NAMES[expected]
        raise InputError(must(f"column {name}", f"{stem}_{expected}, in {unit}", f"the unit {suffix}", where))


def _check_complete(triple: tuple[str, ...], names: set[str], where: object) -> None:
    absent = [name for name in triple if name not in names]
    if 0 < len(absent) < len(triple):
        given = ", ".join(name for name in triple if name in names)
        raise InputError(must(f"column {absent[0]}", f"given beside {given}", "two axes or one", where))


def _check_readings(names: set[str], where: object) -> None:
    has_set, has_reset = set(SET) <= names, set(RESET) <= names
    if has_set != has_reset:
        absent = RESET[0] if has_set else SET[0]
        raise InputError(must(f"column {absent}", "given: SET and RESET come in pairs", "one of the two", where))
    if not has_set and not set(READINGS) <= names:
        wanted = "one with the readings x_lsb, y_lsb, z_lsb, or x_set_lsb.. and x_reset_lsb.."
        raise InputError(must("the log", wanted, f"columns {listed(sorted(names))}; {OTHER_TABLES}", where))
