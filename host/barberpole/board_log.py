"""The board's framed records (.bpr) as columns, with the self-calibration found among them."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from barberpole.columns import CURRENT, RESET, SET, check_names
from barberpole.errors import InputError, must
from barberpole.frame_content import CODES, fault
from barberpole.records import EVENT, FORMAT, HEADER, POINT, POINTS, RESULT, ROWS, RUN, SEQUENCES, TYPES, Frame, decode


@dataclass(frozen=True)
class SelfcalRun:
    """A self-calibration as the board recorded it; m points, arrays (3, m) or (m,).

    unit        coil currents in trajectory units, -1 to 1
    set_lsb, reset_lsb      averages in LSB, raw polarity
    current_ma  read back; temp_c
    header      id of the trajectory, current of a unit and so on; result the board's verdict, None if it never came
    """

    header: dict[str, Any]
    index: np.ndarray
    unit: np.ndarray
    set_lsb: np.ndarray
    reset_lsb: np.ndarray
    current_ma: np.ndarray
    temp_c: np.ndarray
    result: dict[str, Any] | None


@dataclass(frozen=True)
class BoardLog:
    """What a .bpr holds of the last power-up that says anything. `skipped` counts damaged and lost frames."""

    columns: dict[str, np.ndarray]
    meta: dict[str, Any]
    selfcal: SelfcalRun | None
    skipped: int
    notes: tuple[str, ...]


@dataclass
class _PowerUp:
    """The frames between one header and the next."""

    header: dict[str, Any] = field(default_factory=dict)
    of: dict[str, list[Frame]] = field(default_factory=lambda: {kind: [] for kind in TYPES})


def read_board_log(data: bytes, where: object) -> BoardLog:
    """Columns and self-calibration out of the bytes of a .bpr. Raises InputError if there is nothing to read."""
    stream = decode(data)
    notes = _damage(stream.damaged, stream.lost)
    power_up, orphans, earlier = _last_power_up(stream.frames, where)
    if orphans:
        notes.append(f"{orphans} frames before the first header cannot be read and were skipped")
    if earlier:
        notes.append(f"{earlier} frames of earlier power-ups were left out")
    if twice := _take_once(power_up):
        notes.append(f"{twice} records came twice and were taken once")
    selfcal, bad_points = _selfcal(power_up)
    columns, bad_rows = _rows(power_up, where)
    if bad_points + bad_rows:
        notes.append(f"{bad_points + bad_rows} frames did not have the length that the header gives and were skipped")
    if not columns and selfcal is not None:
        columns = _points_as_columns(selfcal)
        notes.append("no streamed rows: the columns hold the points of the self-calibration")
    if not columns:
        raise InputError(must("the board record", "one with rows or points", "neither", where))
    results = [f.json for f in power_up.of[RESULT]]
    meta = {
        **power_up.header,
        "polarity": "raw",
        "events": [f.json for f in power_up.of[EVENT]],
        "result": results[-1] if results else None,
    }
    return BoardLog(columns, meta, selfcal, stream.skipped + orphans + bad_points + bad_rows, tuple(notes))


def _damage(damaged: int, lost: int) -> list[str]:
    notes = []
    if damaged:
        notes.append(f"{damaged} damaged records were skipped")
    if lost:
        notes.append(f"{lost} records are missing from the sequence")
    return notes


def _last_power_up(frames: tuple[Frame, ...], where: object) -> tuple[_PowerUp, int, int]:
    """The last power-up with rows or points, frames before any header, and frames of earlier power-ups."""
    power_ups: list[_PowerUp] = []
    early: list[Frame] = []
    last = None
    for frame in frames:
        if frame.type != HEADER:
            (power_ups[-1].of[frame.type] if power_ups else early).append(frame)
        elif not (power_ups and last and _goes_on(power_ups[-1].header, frame, last)):
            power_ups.append(_PowerUp(_checked_header(frame.json or {}, where)))
            if len(power_ups) == 1 and frame.sequence:
                for heard in (joined := _of_one_power_up(early, frame)):
                    power_ups[0].of[heard.type].append(heard)
                del early[len(early) - len(joined) :]
        last = frame
    orphans = len(early)
    telling = [p for p in power_ups if p.of[ROWS] or p.of[POINTS]]
    if not telling:
        found = "no header" if not power_ups else "neither rows nor points"
        raise InputError(must("the board record", "framed lines: a header, then rows or points", found, where))
    earlier = sum(len(kind) for p in telling[:-1] for kind in p.of.values())
    return telling[-1], orphans, earlier


def _take_once(power_up: _PowerUp) -> int:
    """Leave out rows and points that came before, under the same number with the same content; how many they were."""
    count = 0
    for kind in (ROWS, POINTS):
        frames = power_up.of[kind]
        steps = np.diff([frame.sequence for frame in frames]) % SEQUENCES
        if not np.any((steps == 0) | (steps >= SEQUENCES // 2)):
            continue  # as it should be: nothing to remember
        seen: dict[int, bytes] = {}
        kept = []
        for frame in frames:
            if seen.get(frame.sequence) != frame.payload:
                kept.append(frame)
            seen[frame.sequence] = frame.payload
        count += len(frames) - len(kept)
        power_up.of[kind] = kept
    return count


def _goes_on(header: dict[str, Any], frame: Frame, last: Frame) -> bool:
    """Whether this header frame only repeats what began the power-up."""
    again = frame.json or {}
    same = "boot" in header and (header["boot"], header.get("uid")) == (again.get("boot"), again.get("uid"))
    return same and (frame.sequence != 0 or last.sequence == SEQUENCES - 1)


def _of_one_power_up(early: list[Frame], header: Frame) -> list[Frame]:
    """Of the frames before the first header, a repeated one, those of its power-up: where the sequence goes back,
    another ended."""
    later = header.sequence
    for at in range(len(early) - 1, -1, -1):
        if (later - early[at].sequence) % SEQUENCES > SEQUENCES // 2:
            return early[at + 1 :]
        later = early[at].sequence
    return early[:]


def _checked_header(header: dict[str, Any], where: object) -> dict[str, Any]:
    if header.get("format") != FORMAT:
        raise InputError(must("the board record", f"of format {FORMAT}", f"format {header.get('format')}", where))
    if said := fault(HEADER, header, where):
        raise InputError(said)
    return header


def _rows(power_up: _PowerUp, where: object) -> tuple[dict[str, np.ndarray], int]:
    """Scaled columns, and how many frames were not a whole number of rows."""
    layout = power_up.header.get("columns", [])
    frames = power_up.of[ROWS]
    if not frames:
        return {}, 0
    if not layout:
        raise InputError(must("the board record's header", "one with columns", "none", where))
    other_role = power_up.header.get("role") in ("coil_driver", "array")
    check_names([name for name, _, _ in layout], where, readings=not other_role)
    kind = np.dtype([(f"{i} {name}", CODES[code]) for i, (name, code, _) in enumerate(layout)])
    whole = [f.payload for f in frames if f.payload and len(f.payload) % kind.itemsize == 0]
    table = np.frombuffer(b"".join(whole), kind)
    columns = {name: table[f"{i} {name}"] * float(scale) for i, (name, _, scale) in enumerate(layout)}
    return (columns if table.size else {}), len(frames) - len(whole)


def _selfcal(power_up: _PowerUp) -> tuple[SelfcalRun | None, int]:
    """The coil run, and how many points had a wrong length."""
    frames = power_up.of[POINTS]
    whole = [f.payload for f in frames if len(f.payload) == POINT.size]
    if not whole:
        return None, len(frames)
    table = np.array([POINT.unpack(payload) for payload in whole]).T
    headers, results = power_up.of[RUN], power_up.of[RESULT]
    run = SelfcalRun(
        header=(headers[-1].json or {}) if headers else {},
        index=table[0].astype(int),
        unit=table[1:4],
        set_lsb=table[4:7],
        reset_lsb=table[7:10],
        current_ma=table[10:13],
        temp_c=table[13],
        result=results[-1].json if results else None,
    )
    return run, len(frames) - len(whole)


def _points_as_columns(run: SelfcalRun) -> dict[str, np.ndarray]:
    columns = {}
    for names, values in ((SET, run.set_lsb), (RESET, run.reset_lsb), (CURRENT, run.current_ma)):
        columns.update(zip(names, values, strict=True))
    return {**columns, "temp_c": run.temp_c}
