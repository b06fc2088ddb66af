"""What happens to files: bits flip, ends are lost, parts come twice, out of order or from elsewhere; numbers grow."""

import random
import re
from collections.abc import Callable

LARGEST = 200_000  # bytes of a damaged file: small, whatever it claims
NUMBER = re.compile(rb"-?\d+\.?\d*(?:e-?\d+)?")
WORD = re.compile(rb'"[^"\n]*"|[\w.]+')
WORDS = (
    b"nan inf -inf 1e999 -1e308 1e-320 0 -0 1000000000 99999999999999999999 0x10 1_000 true null {} [] "
    b"\"\" \xff\xfe \x00 \xef\xbb\xbf \r \n\n , ; = . # [[ ]] ''' \"\"\" $ __import__('os') %s {0} "
    b"x_lsb t_s b_ut effects plugins cross_field lag"
).split(b" ")

Damage = Callable[[bytes, int, int], bytes]


def flip_bit(data: bytes, at: int, how: int) -> bytes:
    where = at % max(len(data), 1)
    return data[:where] + bytes([data[where] ^ 1 << how % 8]) + data[where + 1 :] if data else data


def cut(data: bytes, at: int, how: int) -> bytes:
    where = at % (len(data) + 1)
    return data[:where] if how % 2 else data[where:]


def remove(data: bytes, at: int, how: int) -> bytes:
    where = at % (len(data) + 1)
    return data[:where] + data[where + how % 64 :]


def put_in(data: bytes, at: int, how: int) -> bytes:
    where = at % (len(data) + 1)
    return data[:where] + WORDS[how % len(WORDS)] + data[where:]


def repeat(data: bytes, at: int, how: int) -> bytes:
    where = at % (len(data) + 1)
    return data[:where] + data[where : where + how % 200] * (2 + how % 50) + data[where:]


def other_number(data: bytes, at: int, how: int) -> bytes:
    """One of the numbers is another."""
    found = list(NUMBER.finditer(data))
    if not found:
        return data
    one = found[at % len(found)]
    return data[: one.start()] + WORDS[how % 12] + data[one.end() :]


def swap_lines(data: bytes, at: int, how: int) -> bytes:
    lines = data.split(b"\n")
    i, j = at % len(lines), how % len(lines)
    lines[i], lines[j] = lines[j], lines[i]
    return b"\n".join(lines)


def replay(data: bytes, at: int, how: int) -> bytes:
    """Lines that came before come again."""
    lines = data.split(b"\n")
    i = at % len(lines)
    return b"\n".join([*lines, *lines[i : i + how % 40]])


def without_line(data: bytes, at: int, how: int) -> bytes:
    lines = data.split(b"\n")
    del lines[at % len(lines)]
    return b"\n".join(lines)


def many_columns(data: bytes, at: int, how: int) -> bytes:
    first, mark, rest = data.partition(b"\n")
    return first + b",c" * (how % 20_000) + mark + rest


def deep(data: bytes, at: int, how: int) -> bytes:
    """Brackets in brackets."""
    return data + b"\na = " + b"[" * (1 + how % 5000) + (b"]" * (1 + how % 5000) if at % 2 else b"")


def other_lines(data: bytes, at: int, how: int) -> bytes:
    """Written by another machine: line ends, byte order marks, UTF-16."""
    return (
        data.replace(b"\n", b"\r\n"),
        data.replace(b"\n", b"\r"),
        b"\xef\xbb\xbf" + data,
        data.decode("latin-1").encode("utf-16"),
    )[how % 4]


def many_digits(data: bytes, at: int, how: int) -> bytes:
    """One of the numbers has more digits than anybody can measure."""
    found = list(NUMBER.finditer(data))
    if not found:
        return data
    one = found[at % len(found)]
    return data[: one.end()] + b"7" * (how % LARGEST) + data[one.end() :]


def other_word(data: bytes, at: int, how: int) -> bytes:
    """One of the words stands where another stood."""
    found = list(WORD.finditer(data))
    if not found:
        return data
    one, other = found[at % len(found)], found[how % len(found)]
    return data[: one.start()] + other[0] + data[one.end() :]


DAMAGES: tuple[Damage, ...] = (
    flip_bit,
    flip_bit,
    cut,
    remove,
    put_in,
    put_in,
    repeat,
    other_number,
    other_number,
    other_number,
    swap_lines,
    replay,
    without_line,
    many_columns,
    deep,
    other_lines,
    many_digits,
    other_word,
    other_word,
)
MOST = 4  # things that happen to one file
ANYWHERE = 1 << 20


def damaged(data: bytes, rng: random.Random) -> bytes:
    """The file after one to four of them."""
    for _ in range(rng.randint(1, MOST)):
        data = rng.choice(DAMAGES)(data, rng.randrange(ANYWHERE), rng.randrange(ANYWHERE))[:LARGEST]
    return data
