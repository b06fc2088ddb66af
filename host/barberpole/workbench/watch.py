"""A board watched live: a thread that reads its port, keeps the last minutes, records, and comes back when it does.

Memory is flat: rows are kept in rings of fixed length, everything else is counted or the latest alone. Nothing is
decided here; `Seen` is a copy that the page may draw at leisure.
"""

import contextlib
import threading
import time
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import serial

from barberpole.errors import BarberpoleError, PortError, must
from barberpole.frame_content import fault, layout_of
from barberpole.link.mpremote import require_port
from barberpole.link.record import RESTART
from barberpole.records import ANSWER, EVENT, HEADER, RESULT, ROWS, Decoder, Frame
from barberpole.workbench.rotation import Coverage

KEPT = 4000  # rows in the ring
EVENTS = 30
WAIT_S = 0.2  # of one read
AGAIN_S = 0.5  # between two attempts to open a port that is gone
SILENCE_S = 3.0
NAMES = ("t_s", "b_ut", "offset_x", "offset_y", "offset_z", "temp_c")


@dataclass(frozen=True)
class Seen:
    """The board as it was a moment ago. rows: by name (`NAMES`), oldest first; lost and damaged: frames so far."""

    state: str
    header: dict[str, Any]
    verdict: dict[str, Any]
    answer: dict[str, Any]
    events: tuple[str, ...]
    rows: dict[str, np.ndarray]
    total: int
    lost: int
    damaged: int
    rate_hz: float
    connections: int
    recording: str
    coverage: Coverage


@dataclass
class Watch:
    """Begin with `start`, end with `close`. All methods may be called from any thread."""

    port: str
    _rows: dict[str, np.ndarray] = field(default_factory=lambda: {name: np.empty(KEPT) for name in NAMES})
    _at: int = 0
    total: int = 0
    lost: int = 0
    damaged: int = 0
    connections: int = 0
    state: str = "connecting"
    header: dict[str, Any] = field(default_factory=dict)
    verdict: dict[str, Any] = field(default_factory=dict)
    answer: dict[str, Any] = field(default_factory=dict)
    events: deque = field(default_factory=lambda: deque(maxlen=EVENTS))
    coverage: Coverage = field(default_factory=Coverage)

    def __post_init__(self) -> None:
        self._lock, self._over = threading.Lock(), threading.Event()
        self._line: serial.Serial | None = None
        self._file: BinaryIO | None = None
        self._name, self._pending = "", b""
        self._kind: np.dtype | None = None
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> None:
        """Open the port and read. Raises PortError where it is no port."""
        require_port(self.port)
        if not Path(self.port).is_char_device():
            raise PortError(must("the port", "a serial port", "something else", self.port))
        self._thread.start()

    def close(self) -> None:
        """Stop reading; a recording ends whole."""
        self._over.set()
        if self._thread.is_alive():
            self._thread.join(2.0)
        self.stop_recording()

    def record(self, path: Path) -> None:
        """Keep what the board sends from here on (.bpr); it is asked to repeat its header by a restart if need be."""
        with self._lock:
            self._file, self._name, self._pending = path.open("wb"), path.name, b""

    def stop_recording(self) -> str:
        """The name of the file that is whole now, '' without one."""
        with self._lock:
            name, self._name = self._name, ""
            if self._file:
                self._file.close()
                self._file = None
            return name

    def restart(self) -> None:
        """Have the board start again: its self-calibration at power-up is then seen."""
        with contextlib.suppress(OSError):
            if self._line:
                self._line.write(RESTART)

    def say(self, command: str) -> None:
        """A command of `barberpole.link.listen.COMMANDS` to the running program; its answer comes in `answer`."""
        with contextlib.suppress(OSError):
            if self._line:
                self._line.write(b"\n" + command.encode() + b"\n")

    def forget_rotation(self) -> None:
        """Begin the guided rotation anew."""
        with self._lock:
            self.coverage = Coverage()

    def seen(self) -> Seen:
        """A copy of what is known now."""
        with self._lock:
            count = min(self.total, KEPT)
            order = (np.arange(count) + self._at - count) % KEPT
            rows = {name: values[order] for name, values in self._rows.items()}
            t = rows["t_s"]
            rate = (count - 1) / (t[-1] - t[0]) if count > 1 and t[-1] > t[0] else float("nan")
            return Seen(
                self.state,
                self.header,
                self.verdict,
                self.answer,
                tuple(self.events),
                rows,
                self.total,
                self.lost,
                self.damaged,
                float(rate),
                self.connections,
                self._name,
                self.coverage.copy(),
            )

    def _run(self) -> None:
        while not self._over.is_set():
            try:
                with serial.Serial(self.port, 115200, timeout=WAIT_S) as line:
                    self._line = line
                    self.connections += 1
                    self._read(line)
            except (OSError, BarberpoleError) as error:  # SerialException among them: unplugged, or not there yet
                self.state = f"waiting for {self.port}: {getattr(error, 'strerror', None) or error}"
            finally:
                self._line = None
            self._over.wait(AGAIN_S)

    def _read(self, line: serial.Serial) -> None:
        decoder, heard = Decoder(), time.monotonic()
        self.state = "connected, silent so far"
        before = (self.lost, self.damaged)
        while not self._over.is_set():
            data = line.read(max(1, line.in_waiting))
            now = time.monotonic()
            if not data:
                if now - heard > SILENCE_S:
                    self.state = "connected, but the board is silent: is main.py running?"
                continue
            heard, self.state = now, "live"
            frames = decoder.feed(data)
            with self._lock:
                self._keep(data)
                self.lost, self.damaged = before[0] + decoder.lost, before[1] + decoder.damaged
                self._take(frames)

    def _keep(self, data: bytes) -> None:
        """Whole frame lines go to the recording as they came."""
        if self._file is None:
            return
        *whole, self._pending = (self._pending + data).split(b"\n")
        try:
            self._file.write(b"".join(text.rstrip(b"\r") + b"\n" for text in whole if text.startswith(b"$")))
            self._file.flush()
        except OSError as error:  # a full disk ends the recording, not the watching
            self.events.append(f"recording {self._name} ended: {error.strerror}")
            with contextlib.suppress(OSError):
                self._file.close()
            self._file, self._name = None, ""

    def _take(self, frames: list[Frame]) -> None:
        rows = []
        for frame in frames:
            if frame.type == HEADER:
                if not fault(HEADER, frame.json or {}):
                    self.header = frame.json or {}
                    self._kind = layout_of(self.header)
            elif frame.type == RESULT:
                self.verdict = frame.json or {}
            elif frame.type == EVENT:
                self.events.append(str((frame.json or {}).get("text", "")))
            elif frame.type == ANSWER:
                self.answer = frame.json or {}
            elif frame.type == ROWS and self._kind is not None and len(frame.payload) % self._kind.itemsize == 0:
                rows.append(frame.payload)
        if any(rows) and self._kind is not None:
            self._put(np.frombuffer(b"".join(rows), self._kind))

    def _put(self, table: np.ndarray) -> None:
        """Rows into the ring, and their directions into the coverage."""
        scale = {name: float(factor) for name, _, factor in self.header["columns"]}

        def column(name: str) -> np.ndarray:
            if name not in scale:
                return np.full(len(table), np.nan)
            return table[name] * scale[name]

        field_ut = np.stack([column(f"c{a}_ut") for a in "xyz"])
        self.coverage.add(field_ut)
        new = {"t_s": column("t_s"), "b_ut": np.linalg.norm(field_ut, axis=0), "temp_c": column("temp_c")}
        new |= {f"offset_{a}": 0.5 * (column(f"{a}_set_lsb") + column(f"{a}_reset_lsb")) for a in "xyz"}
        last = slice(-KEPT, None)
        at = (self._at + np.arange(len(table))[last]) % KEPT
        for name, values in new.items():
            self._rows[name][at] = values[last]
        self._at, self.total = (self._at + len(table)) % KEPT, self.total + len(table)
