"""The board's frames: one line of text each, so that a damaged one is dropped alone.

    "$" base64( type:1 | sequence:uint16 | payload | crc:uint16 ) newline

Little-endian; the CRC is CCITT-FALSE over type, sequence and payload. Text between frames (a REPL's banner) is not
damage; a "$" line that is no whole frame is damage, counted; a gap in the sequence that no damaged line accounts for
is counted as lost. "$" never occurs inside base64, so reading finds its step again at the next frame.
"""

import base64
import binascii
import json
import re
import struct
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from barberpole.frame_content import fault

HEADER, ROWS, EVENT, RUN, POINTS, RESULT, ANSWER = "H", "D", "E", "T", "P", "S", "A"
TYPES = frozenset((HEADER, ROWS, EVENT, RUN, POINTS, RESULT, ANSWER))
JSON_TYPES = frozenset((HEADER, EVENT, RUN, RESULT, ANSWER))
FORMAT = 1

POINT = struct.Struct("<h13f")
"""A point of a coil run: index; ux uy uz in trajectory units; SET xyz and RESET xyz averages in LSB, raw polarity;
ix iy iz in mA; temperature in °C."""

SEQUENCES = 1 << 16
LONGEST_LINE = 1 << 16  # what is longer without a newline is no frame of ours

_FRAME = re.compile(rb"\$([A-Za-z0-9+/=]+)\r?$")


@dataclass(frozen=True)
class Frame:
    """One undamaged frame. `json` is the content of a JSON type, None for the others."""

    type: str
    sequence: int
    payload: bytes
    json: dict[str, Any] | None = None


@dataclass(frozen=True)
class Stream:
    """What a stretch of bytes held: the frames in order, damaged "$" lines, and frames lost without a trace."""

    frames: tuple[Frame, ...]
    damaged: int
    lost: int

    @property
    def skipped(self) -> int:
        return self.damaged + self.lost


def encode(kind: str, sequence: int, payload: bytes) -> bytes:
    """One frame with its newline. `sequence` is taken modulo 65536."""
    body = struct.pack("<BH", ord(kind), sequence % SEQUENCES) + payload
    return b"$" + base64.b64encode(body + struct.pack("<H", crc16(body))) + b"\n"


def encode_json(kind: str, sequence: int, content: dict[str, Any]) -> bytes:
    """One frame of a JSON type."""
    return encode(kind, sequence, json.dumps(content).encode())


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF."""
    return binascii.crc_hqx(data, 0xFFFF)


def decode(data: bytes) -> Stream:
    """All frames in `data`. Never raises: what is not a whole frame is counted or, between frames, ignored."""
    decoder = Decoder()
    frames = [*decoder.feed(data), *decoder.finish()]
    return Stream(tuple(frames), decoder.damaged, decoder.lost)


class Decoder:
    """Frames out of bytes as they arrive. `damaged` and `lost` count what was skipped so far."""

    def __init__(self) -> None:
        self.damaged = 0
        self.lost = 0
        self._pending = b""
        self._expected: int | None = None
        self._furthest: int | None = None  # what is expected where a replay ends
        self._unexplained = 0  # damaged lines since the last frame: they account for a gap

    def feed(self, data: bytes) -> list[Frame]:
        """The frames completed by `data`."""
        *lines, self._pending = (self._pending + data).split(b"\n")
        self._pending = self._pending[-LONGEST_LINE:]
        return self._take(lines)

    def finish(self) -> list[Frame]:
        """The frame in a last line that lacks its newline, if it is whole."""
        line, self._pending = self._pending, b""
        return self._take([line])

    def _take(self, lines: Iterable[bytes]) -> list[Frame]:
        return [frame for line in lines for frame in self._frames_of(line)]

    def _frames_of(self, line: bytes) -> list[Frame]:
        """Frames of one line: one, or several where a newline between them was damaged."""
        first, *others = line.split(b"$")
        frames = []
        for number, part in enumerate(others):
            frame = parse(b"$" + part)
            if frame is not None:
                frames.append(self._counted(frame))
            elif number == 0 and not first:  # text with a "$" in it is no damaged frame
                self.damaged += 1
                self._unexplained += 1
        return frames

    def _counted(self, frame: Frame) -> Frame:
        if begins_power_up(frame):  # which counts afresh
            self._furthest = None
        elif self._expected is not None:
            self.lost += max(0, self._gap(frame.sequence, self._expected) - self._unexplained)
        self._expected = (frame.sequence + 1) % SEQUENCES
        self._unexplained = 0
        return frame

    def _gap(self, sequence: int, expected: int) -> int:
        """Frames missing before this one. It may go back: a power-up whose header is damaged, or frames that come
        again, after which the stream goes on where it was."""
        gap = (sequence - expected) % SEQUENCES
        if gap >= SEQUENCES // 2:
            if self._furthest is None or (expected - self._furthest) % SEQUENCES < SEQUENCES // 2:
                self._furthest = expected
            return 0
        if self._furthest is None or (beyond := (sequence - self._furthest) % SEQUENCES) >= SEQUENCES // 2:
            return gap
        self._furthest = None
        return min(gap, beyond)


def begins_power_up(frame: Frame) -> bool:
    """Whether this is the header of a power-up, and not one repeated for readers that join later."""
    return frame.type == HEADER and frame.sequence == 0


def parse(line: bytes) -> Frame | None:
    """The frame of one line, None if it is not whole."""
    match = _FRAME.match(line)
    if match is None:
        return None
    try:
        raw = base64.b64decode(match[1], validate=True)
    except binascii.Error:
        return None
    if len(raw) < 5 or crc16(raw[:-2]) != int.from_bytes(raw[-2:], "little"):
        return None
    kind, sequence = struct.unpack_from("<BH", raw)
    return _typed(chr(kind), sequence, raw[3:-2])


def _typed(kind: str, sequence: int, payload: bytes) -> Frame | None:
    if kind not in TYPES:
        return None
    if kind not in JSON_TYPES:
        return Frame(kind, sequence, payload)
    try:
        content = json.loads(payload)
    except (ValueError, RecursionError):
        return None
    if not isinstance(content, dict) or (kind != HEADER and fault(kind, content)):
        return None  # a header that is wrong in itself is told by whoever reads the record
    return Frame(kind, sequence, payload, content)
