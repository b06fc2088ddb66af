"""Which measurement of the article a log is (2.4): told from its columns and its data, never from its name."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from barberpole.errors import InputError, must
from barberpole.log import Log
from barberpole.methods.readings import demodulated, scalar
from barberpole.methods.scalar import require_seen
from barberpole.methods.turn_over import COLUMN as TURN

FREQUENCY = "f_hz"  # column with the frequency of the applied sine, where the log says
FLAT = 1e-3  # of the applied field's largest direction: below this it does not vary there
STILL = 20.0  # standard deviation over that of neighbours, above which a sensor moves
WHAT = "characterise"


@dataclass(frozen=True)
class Sorted:
    """Logs by measurement: linearity (applied field in space), turned by hand, rest, sine, turn-over."""

    linear: tuple[Log, ...]
    turned: tuple[Log, ...]
    rest: tuple[Log, ...]
    sine: tuple[Log, ...]
    turned_over: tuple[Log, ...]
    notes: tuple[str, ...]

    def readings(self, log: Log) -> np.ndarray:
        """(3, n) LSB, demodulated."""
        return demodulated(log, WHAT).y

    def rate_hz(self, log: Log) -> float:
        """Mean sampling rate. Raises InputError without a time that goes on."""
        t = log["t_s"]
        if not t[-1] > t[0]:
            raise InputError(must("column t_s", "a time that goes on", f"{t[0]:g} to {t[-1]:g} s", log.path))
        return float((len(t) - 1) / (t[-1] - t[0]))


def sort_logs(logs: Sequence[Log]) -> Sorted:
    """Each log by its kind. Raises InputError where one is of none."""
    kinds = [kind(log) for log in logs]

    def of(name: str) -> tuple[Log, ...]:
        return tuple(log for log, k in zip(logs, kinds, strict=True) if k == name)

    notes = tuple(f"{log.path.name}: {name}" for log, name in zip(logs, kinds, strict=True))
    return Sorted(of("linearity"), of("turned"), of("at rest"), of("sine"), of("turn-over"), notes)


def kind(log: Log) -> str:
    """linearity, turned, at rest, sine or turn-over. Raises InputError where a log is none of them."""
    if log.has(TURN):
        return "turn-over"
    if log.has(FREQUENCY):
        return "sine"
    seen = demodulated(log, WHAT)
    if seen.b_ut is not None and (varied := _directions(seen.b_ut)):
        if varied == 3:
            return "linearity"
        if varied == 1 and log.has("t_s"):
            return "sine"
    return _without_field(log, seen.y)


def _directions(field_ut: np.ndarray) -> int:
    """In how many directions an applied field varies."""
    size = np.sqrt(np.linalg.svd(np.cov(field_ut), compute_uv=False))
    return int(np.sum(size > FLAT * size[0])) if size[0] > 0 else 0


def _without_field(log: Log, y: np.ndarray) -> str:
    """Whether the sensor moved in one magnitude of field or lay still."""
    try:
        require_seen(scalar(log, WHAT), 50.0)
    except InputError:
        near = np.std(np.diff(y, axis=1), axis=1) / np.sqrt(2.0)
        if np.all(np.std(y, axis=1) <= STILL * np.maximum(near, 1.0 / np.sqrt(12.0))):
            return "at rest"
    else:
        return "turned"
    wanted = "at rest, turned through all directions, or with an applied field (or a column turn, or f_hz)"
    raise InputError(must("a log to characterise", wanted, "one that moves a little", log.path))
