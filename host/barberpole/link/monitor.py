"""What a streaming board says, second by second: means of its rows, its rate, what was lost, its last verdict."""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from barberpole.errors import PortError, must
from barberpole.frame_content import fault, layout_of
from barberpole.link.listen import Listener
from barberpole.reasons import TABLE
from barberpole.records import EVENT, HEADER, RESULT, ROWS, Frame

SILENCE_S = 8.0
FIELD = ("cx_ut", "cy_ut", "cz_ut")
NO_FIELD = (math.nan, math.nan, math.nan)


@dataclass(frozen=True)
class Second:
    """Means of one second of rows.

    t_s of the board; field_ut and their norm b_ut; offset_lsb: (SET + RESET) / 2 by axis; temp_c; rate_hz of the rows
    by the board's clock; lost: frames missing from the sequence so far. NaN where no row said it.
    """

    t_s: float
    field_ut: tuple[float, ...]
    b_ut: float
    offset_lsb: tuple[float, ...]
    temp_c: float
    supply_v: float
    rate_hz: float
    rows: int
    lost: int
    accepted: bool | None
    in_force: str
    reasons: tuple[str, ...]
    events: tuple[str, ...]
    calibration: str

    def to_json(self) -> dict[str, Any]:
        """The same as plain values."""
        return {name: list(v) if isinstance(v, tuple) else v for name, v in vars(self).items()}


@dataclass
class _Heard:
    """What is known of the board, and the rows since the last second."""

    header: dict[str, Any] = field(default_factory=dict)
    verdict: dict[str, Any] = field(default_factory=dict)
    events: list[str] = field(default_factory=list)
    rows: list[bytes] = field(default_factory=list)

    def take(self, frame: Frame) -> None:
        content = frame.json or {}
        if frame.type == HEADER:
            self.header = content if not fault(HEADER, content) else self.header
        elif frame.type == RESULT:
            self.verdict = content
        elif frame.type == EVENT:
            detail = content.get("values", {}).get("detail", "")
            self.events.append(f"{content.get('name', '?')} {detail}".strip())
        elif frame.type == ROWS:
            self.rows.append(frame.payload)

    def table(self) -> np.ndarray | None:
        """Rows as a structured array, unscaled; None where there are none or no header has named the columns."""
        kind = layout_of(self.header)
        whole = b"" if kind is None else b"".join(row for row in self.rows if len(row) == kind.itemsize)
        return np.frombuffer(whole, kind) if whole else None


def seconds(board: Listener, interval_s: float = 1.0) -> Iterator[Second]:
    """One `Second` after the other; a stopped board gives seconds without rows.

    Raises PortError when nothing at all is heard for SILENCE_S, or the cable is unplugged.
    """
    heard = _Heard()
    last_heard = due = time.monotonic()
    due += interval_s
    while True:
        for frame in board.frames():
            heard.take(frame)
            last_heard = time.monotonic()
        now = time.monotonic()
        if now - last_heard > SILENCE_S:
            raise PortError(must("the board", "sending records (main.py running)", f"silence for {SILENCE_S:g} s"))
        if now >= due and heard.header:
            yield _second(heard, board.decoder.lost + board.decoder.damaged)
            heard.rows.clear()
            heard.events.clear()
            due = now + interval_s


def _second(heard: _Heard, lost: int) -> Second:
    table = heard.table()
    scales = {name: scale for name, _, scale in heard.header.get("columns", [])}

    def column(name: str) -> np.ndarray:
        return table[name] * float(scales[name]) if table is not None and name in scales else np.array([math.nan])

    xyz = tuple(_mean(column(name)) for name in FIELD)
    offsets = (0.5 * (column(f"{a}_set_lsb") + column(f"{a}_reset_lsb")) for a in "xyz")
    t_s, rows = column("t_s"), 0 if table is None else len(table)
    verdict = heard.verdict
    return Second(
        t_s=float(t_s[-1]),
        field_ut=xyz,
        b_ut=math.hypot(*xyz),
        offset_lsb=tuple(_mean(v) for v in offsets),
        temp_c=_mean(column("temp_c")),
        supply_v=_mean(column("supply_v")),
        rate_hz=(rows - 1) / float(t_s[-1] - t_s[0]) if rows > 1 and t_s[-1] > t_s[0] else math.nan,
        rows=rows,
        lost=lost,
        accepted=verdict.get("accepted"),
        in_force=verdict.get("in_force", ""),
        reasons=tuple(_name(code) for code in verdict.get("reasons", [])),
        events=tuple(heard.events),
        calibration=heard.header.get("calibration", ""),
    )


def _mean(values: np.ndarray) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else math.nan


def _name(code: int) -> str:
    return TABLE[code].name if 0 <= code < len(TABLE) else str(code)
