"""Frames: what was written comes back, and no damage raises or takes an undamaged frame with it."""

import struct

from barberpole.records import Decoder, crc16, decode, encode, encode_json, parse
from hypothesis import given
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
