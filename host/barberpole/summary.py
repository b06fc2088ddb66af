"""A log at a glance: what is in it, what is wrong with it, and what it can and cannot show."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from barberpole.columns import RESET, SET
from barberpole.diagnose.resting import longest_rest
from barberpole.diagnose.still import level, still
from barberpole.diagnose.stretches import taken
from barberpole.effects import STACK
from barberpole.errors import InputError
from barberpole.fit.ellipsoid import algebraic
from barberpole.fit.fit import MAD, missing_columns
from barberpole.log import Log
from barberpole.observations import Observations, observations
from barberpole.sensor import Sensor
from barberpole.units import NAMES
from barberpole.verify import coils_driven

BANDS, SECTORS = 6, 12  # of directions, all of equal area: one is 27° across
GAP = 3.0  # median intervals
FEW = 30  # readings, of which none is told from the others
SPIKE = 10.0  # robust standard deviations from both neighbours
QUIET = 0.3  # of the spread of the whole log: what rests varies less
LEVEL_C = 2.0  # span of temperature below which its effects hardly show
SURROUNDED = 0.5  # of the directions: fewer do not part bias, scale and angles
NEED_NO_TURNS = (
    "outliers",
    "drift",
    "mains",
    "bias_temperature",
    "coil_coupling",
    "load_current",
)  # shown by time or current


@dataclass(frozen=True)
class Column:
    """One column: unit ("" where its name tells none), range and mean."""

    name: str
    unit: str
    low: float
    high: float
    mean: float


@dataclass(frozen=True)
class Summary:
    """What `summary --json` prints.

    rate_hz from the median interval; gaps: intervals over GAP of it. form: what a reading is. reference: what is known
    of the field. directions: cells of equal area that the field pointed into, of `directions_of`. still_rows: longest
    stretch in which nothing moved. spikes: single readings that neither neighbour shares. shows: effects that this log
    can judge; cannot_show: the others, with the reason.
    """

    log: str
    sha256: str
    rows: int
    skipped: int
    duration_s: float | None
    rate_hz: float | None
    gaps: int
    longest_gap_s: float | None
    columns: tuple[Column, ...]
    form: str
    reference: str
    field_ut: tuple[float, float] | None
    flips: int
    directions: int
    directions_of: int
    temp_span_c: float | None
    still_rows: int
    spikes: dict[str, int]
    selfcal_points: int
    shows: tuple[str, ...]
    cannot_show: dict[str, str]
    notes: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Plain numbers, strings, lists and dictionaries."""
        lists = {key: list(getattr(self, key)) for key in ("shows", "notes")}
        field = None if self.field_ut is None else list(self.field_ut)
        return vars(self) | lists | {"columns": [asdict(c) for c in self.columns], "field_ut": field}


def summarise(log: Log, sensor: Sensor | None = None) -> Summary:
    """The summary of a checked log."""
    seen = observations(log, sensor)
    directions = direction_cells(_direction(seen))
    temp = log.get("temp_c")
    interval, gaps, longest = _times(log)
    known = seen.b_ut if seen.b_ut is not None else seen.b_mag
    size = None if known is None else np.linalg.norm(np.atleast_2d(known), axis=0)
    shows, cannot = _shows(log, seen, float(np.mean(directions)))
    return Summary(
        log=log.path.name,
        sha256=log.sha256,
        rows=log.n,
        skipped=log.skipped,
        duration_s=float(np.ptp(log["t_s"])) if log.has("t_s") else None,
        rate_hz=1.0 / interval if interval else None,
        gaps=gaps,
        longest_gap_s=longest,
        columns=tuple(_column(name, values) for name, values in log.columns.items()),
        form=form_of(log),
        reference=seen.reference,
        field_ut=None if size is None else (float(size.min()), float(size.max())),
        flips=_flips(log),
        directions=int(directions.sum()),
        directions_of=directions.size,
        temp_span_c=None if temp is None else float(np.ptp(temp)),
        still_rows=_still_rows(seen, log),
        spikes=spikes(seen),
        selfcal_points=0 if log.selfcal is None else log.selfcal.unit.shape[1],
        shows=shows,
        cannot_show=cannot,
        notes=(*log.notes, *seen.notes),
    )


def form_of(log: Log) -> str:
    """What a reading of this log is, in words."""
    if log.has(*SET, *RESET):
        return "pairs of SET and RESET"
    if not log.has("state"):
        return "demodulated, or of one magnetisation: no state column says which"
    states = set(np.unique(log["state"]))
    if states == {0.0}:
        return "demodulated"
    return "SET and RESET in turns" if {-1.0, 1.0} <= states else "of one magnetisation"


def direction_cells(direction: np.ndarray) -> np.ndarray:
    """(BANDS, SECTORS) of bool: cells of equal area that vectors (3, n) point into."""
    norm = np.linalg.norm(direction, axis=0)
    x, y, z = direction[:, norm > 0] / norm[norm > 0]
    row = np.minimum(((z + 1) / 2 * BANDS).astype(int), BANDS - 1)
    column = np.minimum(((np.arctan2(y, x) / np.pi + 1) / 2 * SECTORS).astype(int), SECTORS - 1)
    seen = np.zeros((BANDS, SECTORS), bool)
    seen[row, column] = True
    return seen


def _direction(seen: Observations) -> np.ndarray:
    """(3, n): the known field, else the readings from the centre of their ellipsoid, else as they are."""
    if seen.b_ut is not None:
        return seen.b_ut
    try:
        return algebraic(seen.y).field(seen.y)
    except InputError:
        return seen.y


def _column(name: str, values: np.ndarray) -> Column:
    unit = NAMES.get(name.rpartition("_")[2], "") if "_" in name else ""
    finite = values[np.isfinite(values)]
    low, high, mean = (float(v) for v in (finite.min(), finite.max(), finite.mean())) if finite.size else (np.nan,) * 3
    return Column(name, unit, low, high, mean)


def _times(log: Log) -> tuple[float | None, int, float | None]:
    """Median interval, gaps and the longest interval that is one, in s."""
    if not log.has("t_s") or log.n < 3:
        return None, 0, None
    steps = np.diff(log["t_s"])
    usual = float(np.median(steps))
    if usual <= 0:
        return None, 0, None
    gaps = steps[steps > GAP * usual]
    return usual, gaps.size, float(gaps.max()) if gaps.size else None


def _flips(log: Log) -> int:
    """Changes of the magnetisation: two a row where rows hold pairs."""
    if log.has(*SET, *RESET):
        return 2 * log.n
    if not log.has("state"):
        return 0
    state = log["state"]
    return int(np.count_nonzero(np.diff(state[state != 0])))


def _still_rows(seen: Observations, log: Log) -> int:
    """Rows of the longest stretch at rest."""
    if still(seen) is not None:
        return log.n
    state = np.broadcast_to(np.asarray(seen.at.state, float), seen.y.shape[1:])
    rows = longest_rest(seen.y, state)
    if rows is None:
        return 0
    resting = level(taken(seen, np.arange(rows.start, rows.stop)))
    if np.any(np.std(resting, axis=1) > QUIET * np.std(level(seen), axis=1)):
        return 0  # it moved at random: no reading is far from where the others are
    return int(np.unique(seen.row[rows]).size)


def spikes(seen: Observations) -> dict[str, int]:
    """Readings by axis that lie far from both neighbours of their own state, which agree with each other."""
    found = dict.fromkeys("xyz", 0)
    state = np.broadcast_to(np.asarray(seen.at.state, float), seen.y.shape[1:])
    for kind in np.unique(state):
        own = np.flatnonzero(state == kind)
        if own.size < FEW:
            continue
        y, beside = seen.y[:, own], own[2:] - own[:-2] == 2 * np.min(np.diff(own))
        off = y[:, 1:-1] - 0.5 * (y[:, 2:] + y[:, :-2])
        apart = np.abs(y[:, 2:] - y[:, :-2])
        usual = MAD * np.median(np.abs(off - np.median(off, axis=1, keepdims=True)), axis=1, keepdims=True)
        calm = beside & np.all(apart < SPIKE * usual, axis=0)  # a sensor that turns jumps on all axes
        lonely = (np.abs(off) > SPIKE * usual) & (apart < 0.3 * np.abs(off)) & (usual > 0) & calm
        for axis, count in zip("xyz", np.count_nonzero(lonely, axis=1), strict=True):
            found[axis] += int(count)
    return found


def _shows(log: Log, seen: Observations, covered: float) -> tuple[tuple[str, ...], dict[str, str]]:
    """Effects of the catalogue that this log can judge, and why it cannot judge the others."""
    shows, cannot = [], {}
    for effect in STACK:
        why = _why_not(effect.name, missing_columns(seen, effect), log, seen, covered)
        if why:
            cannot[effect.name] = why
        else:
            shows.append(effect.name)
    return tuple(shows), cannot


def _could_cover(rows: int) -> float:
    """Part of the directions that so many readings see, each pointing anywhere."""
    return 1.0 - (1.0 - 1.0 / (BANDS * SECTORS)) ** rows


def _why_not(name: str, lacking: tuple[str, ...], log: Log, seen: Observations, covered: float) -> str:
    if lacking:
        return f"no {' and no '.join(lacking)} column"
    if name.endswith("_temperature") and np.ptp(log["temp_c"]) < LEVEL_C:
        return f"the temperature changed by less than {LEVEL_C:g} °C"
    if name in ("coil_coupling", "coil_heating") and not coils_driven(log):
        return "the coils were never driven"
    if name == "load_current" and not np.ptp(log["load_a"]):
        return "the load current never changed"
    state = np.asarray(seen.at.state)
    if name == "flip_asymmetry" and not (np.any(state > 0) and np.any(state < 0)):
        return "SET and RESET are not both there"
    if name not in NEED_NO_TURNS and covered < SURROUNDED * _could_cover(log.n):
        return f"the field pointed into {100 * covered:.0f} % of the directions only"
    return ""
