"""Everything barberpole raises on purpose.

    BarberpoleError         the command line turns it into one line on stderr and exit 2
    ├── InputError          a file, a column, a key or an argument is not what it must be
    │   └── CoverageError   sound readings, but too few or turned too little: a diagnosis is inconclusive, not refused
    ├── LimitError          a board is asked for what its parts cannot do: current, time, range
    └── PortError           a board cannot be reached, or does not answer as it must

Messages follow one pattern, built by `must`: what must be which; got what (where).
"""

LONGEST = 500  # characters of what was got: a file may hold anything


class BarberpoleError(Exception):
    """A problem that the user can mend; the message says what, where and what was expected."""


class InputError(BarberpoleError):
    """What was read is not what it must be."""


class CoverageError(InputError):
    """The readings are not wrong; they do not carry an answer."""


class LimitError(BarberpoleError):
    """A physical limit of the board or the sensor would be exceeded."""


class PortError(BarberpoleError):
    """A serial port or the board behind it does not answer as it must."""


def must(what: str, be: str, got: object, where: object = "") -> str:
    """The one sentence of an error.

    >>> must("flip.pulse_us", "at least 5 µs", "2 µs", "boards/mine.toml")
    'flip.pulse_us must be at least 5 µs; got 2 µs (boards/mine.toml)'
    """
    place = f" ({where})" if where else ""
    return f"{what} must be {be}; got {_short(str(got))}{place}"


def _short(text: str) -> str:
    """What was got, if it is long only its beginning."""
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}… ({len(text)} characters)"
