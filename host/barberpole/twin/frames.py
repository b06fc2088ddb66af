"""Frames of the ADS131M08: words of 24 bits, the last of them a checksum; and frames that are told ahead."""

import binascii
import struct
from typing import NamedTuple

import numpy as np

CHANNELS = 8
WORD_BYTES = 3
FRAME_BYTES = (CHANNELS + 2) * WORD_BYTES
DATA_BYTES = CHANNELS * WORD_BYTES


class Ahead(NamedTuple):
    """The next frames of a converter, if each is read in its time and nothing but its chip select moves."""

    ready_us: list[int]
    """µs. Their times of data-ready and two more of those."""
    frames: bytes
    charge_us: int = 0
    """µs. What the program's arithmetic takes after the last of them."""

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.frames) // FRAME_BYTES


NOTHING = Ahead([], b"")


def word(value: int) -> bytes:
    """A register's 16 bits or a command's at the upper end of a word."""
    return (value << 8).to_bytes(WORD_BYTES, "big")


def data_words(codes: np.ndarray) -> list[bytes]:
    """The data words of conversions with these codes (n, CHANNELS)."""
    wide = codes.astype(">i4").view(np.uint8).reshape(len(codes), CHANNELS, 4)
    data = wide[:, :, 1:].tobytes()
    return [data[at : at + DATA_BYTES] for at in range(0, len(data), DATA_BYTES)]


def checked(words: bytes) -> bytes:
    """Words followed by their checksum (CCITT, seed 0xFFFF) in the upper bits of one more word."""
    return words + struct.pack(">HB", binascii.crc_hqx(words, 0xFFFF), 0)
