"""Frames: what was written comes back, and no damage raises or takes an undamaged frame with it."""

import struct
from pathlib import Path

from barberpole.errors import InputError
from barberpole.log import _from_records, checked
from barberpole.records import Decoder, crc16, decode, encode, encode_json, parse
from hypothesis import given, settings
from hypothesis import strategies as st

PAYLOADS = st.lists(st.binary(max_size=60), min_size=1, max_size=12)


def stream(payloads: list[bytes]) -> list[bytes]:
    return [encode("D", number, payload) for number, payload in enumerate(payloads)]


def test_crc_is_ccitt_false():
    assert crc16(b"123456789") == 0x29B1  # the check value of this CRC


def test_json_frame_comes_back():
    frame = parse(encode_json("H", 70000, {"format": 1}).rstrip(b"\n"))
    assert frame is not None
    assert (frame.type, frame.sequence, frame.json) == ("H", 70000 % 65536, {"format": 1})


@given(PAYLOADS, st.integers(1, 30))
def test_frames_come_back_in_any_pieces(payloads, size):
    data = b"".join(stream(payloads)).replace(b"\n", b"\r\n")
    decoder, frames = Decoder(), []
    for start in range(0, len(data), size):
        frames += decoder.feed(data[start : start + size])
    assert [frame.payload for frame in frames] == payloads
    assert (decoder.damaged, decoder.lost) == (0, 0)


@given(PAYLOADS, st.data())
def test_bit_flip_loses_only_what_it_hit(payloads, draw):
    lines = stream(payloads)
    data = bytearray(b"".join(lines))
    bit = draw.draw(st.integers(0, 8 * len(data) - 1))
    data[bit // 8] ^= 1 << bit % 8
    hit = next(i for i in range(len(lines)) if bit // 8 < sum(map(len, lines[: i + 1])))
    found = decode(bytes(data))
    # A flip of a newline touches the line before it; the frame after it is whole and must survive.
    survivors = [payload for i, payload in enumerate(payloads) if i != hit]
    got = [frame.payload for frame in found.frames]
    assert got in (survivors, payloads)  # payloads: the flip hit what a frame does not need
    if got == survivors and 0 < hit < len(payloads) - 1:
        assert found.skipped >= 1


@given(PAYLOADS, st.integers(0, 2000))
def test_truncation_keeps_what_is_whole(payloads, cut):
    lines = stream(payloads)
    data = b"".join(lines)[:cut]
    whole = sum(1 for i in range(len(lines)) if sum(map(len, lines[: i + 1])) <= cut + 1)  # +1: the last newline
    assert [frame.payload for frame in decode(data).frames] == payloads[:whole]


@given(st.binary(max_size=400))
def test_rubbish_never_raises(data):
    found = decode(data)
    assert found.damaged >= 0
    assert found.lost >= 0


def test_gap_is_lost_and_text_is_not_damage():
    lines = [b"MicroPython v1.28 costs $0\r\n", encode("D", 0, b"a"), b">>> \n", encode("D", 3, b"b")]
    found = decode(b"".join(lines))
    assert [f.payload for f in found.frames] == [b"a", b"b"]
    assert (found.damaged, found.lost) == (0, 2)


def test_damaged_line_accounts_for_its_gap():
    lines = [encode("D", 0, b"a"), encode("D", 1, b"xyz")[:-5] + b"\n", encode("D", 2, b"b")]
    found = decode(b"".join(lines))
    assert (found.damaged, found.lost) == (1, 0)


def test_sequence_wraps_and_a_header_starts_afresh():
    lines = [encode("D", 65535, b""), encode("D", 0, b""), encode_json("H", 0, {}), encode("D", 1, b"")]
    assert decode(b"".join(lines)).lost == 0


def test_unknown_type_and_bad_json_are_damage():
    assert decode(encode("Q", 0, b"")).damaged == 1
    assert decode(encode("H", 0, b"not json")).damaged == 1
    assert decode(encode("H", 0, b"[1]")).damaged == 1


def test_too_short_is_damage():
    body = struct.pack("<B", ord("D"))
    assert parse(b"$" + body) is None


ROW = struct.Struct("<qfff")
LAYOUT = [["t_s", "q", 1e-6], ["x_lsb", "f", 1.0], ["y_lsb", "f", 1.0], ["z_lsb", "f", 1.0]]
DAMAGES = st.lists(
    st.tuples(st.sampled_from(("flip", "cut", "drop", "swap", "again", "insert")), st.integers(0, 1 << 30)), max_size=6
)


def power_up(rows: int) -> list[bytes]:
    """A header and rows that are all different."""
    header = encode_json("H", 0, {"format": 1, "boot": 1, "columns": LAYOUT})
    return [header, *(encode("D", 1 + k, ROW.pack(20_000 * k, k, -k, 0.5 * k)) for k in range(rows))]


def damaged(lines: list[bytes], damages) -> bytes:
    """The stream after what a cable, a disk or a careless copy does to it; its header stays."""
    lines = list(lines)
    for how, at in damages:
        where = 1 + at % max(1, len(lines) - 1)
        line = lines[where] if where < len(lines) else b""
        if how == "flip" and line:
            data, bit = bytearray(line), at % (8 * len(line))
            data[bit // 8] ^= 1 << bit % 8
            lines[where] = bytes(data)
        elif how == "cut":
            lines[where:] = [line[: at % (len(line) + 1)]]
        elif how == "drop":
            del lines[where : where + 1 + at % 3]
        elif how == "swap":
            other = 1 + at // 7 % max(1, len(lines) - 1)
            if max(where, other) < len(lines):
                lines[where], lines[other] = lines[other], lines[where]
        elif how == "again":
            lines[where:where] = lines[max(1, where - at % 4) : where]
        else:
            lines.insert(where, b">>> garbage $" + line[: at % 20] + b"\n")
    return b"".join(lines)


def rows_of(data: bytes):
    """Rows of a record in the contract, and the log."""
    log = checked(_from_records(data, Path("a.bpr")))
    return list(zip(*(log.columns[name].tolist() for name, _, _ in LAYOUT), strict=True)), log


def sent(rows: int) -> list[tuple[float, ...]]:
    return [(20_000 * k * 1e-6, float(k), float(-k), 0.5 * k) for k in range(rows)]


@settings(max_examples=200)
@given(st.integers(2, 40), DAMAGES)
def test_rows_are_some_of_those_sent_each_once(rows, damages):
    """Bit flips, cuts, losses, another order, replays: what is read was sent, no row twice, times never back."""
    try:
        read, log = rows_of(damaged(power_up(rows), damages))
    except InputError:
        return  # nothing was left, or times that go back
    assert set(read) <= set(sent(rows))
    assert len(set(read)) == len(read)
    assert sorted(read) == read
    missing = int(read[-1][1]) + 1 - len(read)  # what is cut off the end leaves no trace
    assert missing == 0 or log.skipped > 0


@given(st.integers(5, 40), st.data())
def test_every_loss_is_counted(rows, draw):
    """Frames that are gone without a trace, never the last: as many as are missing."""
    gone = draw.draw(st.sets(st.integers(1, rows - 1), max_size=rows - 2))
    read, log = rows_of(b"".join(line for k, line in enumerate(power_up(rows)) if k not in gone))
    assert read == [row for k, row in enumerate(sent(rows)) if k + 1 not in gone]
    assert log.skipped == len(gone)


@given(st.integers(3, 40), st.lists(st.tuples(st.integers(0, 40), st.integers(1, 9)), min_size=1, max_size=5))
def test_what_comes_again_counts_once_and_as_no_loss(rows, replays):
    """After any row the last few are said again, as by a copy that went on twice."""
    lines = power_up(rows)
    for end, size in sorted(((2 + at % (rows - 1), size) for at, size in replays), reverse=True):
        lines[end:end] = lines[max(1, end - size) : end]
    read, log = rows_of(b"".join(lines))
    assert read == sent(rows)
    assert log.skipped == 0
    assert any("came twice" in note for note in log.notes)
