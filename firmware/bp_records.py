# bp_records.py: what the board says, as frames that a reader can trust one by one.
# A frame is one line of text: "$", then base64 of type (1 byte), sequence (uint16), payload, and CRC-16 over the
# three, all little-endian. A damaged frame fails its check sum and is dropped by the reader; a lost one leaves a gap
# in the sequence. The header frame names the columns, so a log explains itself. It begins a power-up with sequence 0
# and is repeated now and then for readers that join later: any other sequence says that the power-up goes on.
import binascii
import json
import struct

from micropython import const

HEADER = const(72)  # "H": JSON
ROW = const(68)  # "D": packed as the header's columns say
EVENT = const(69)  # "E": JSON
RUN = const(84)  # "T": JSON, a coil run begins
POINT = const(80)  # "P": packed as POINT_FORMAT
RESULT = const(83)  # "S": JSON, the verdict on the run
FORMAT = const(1)

# index; ux uy uz in trajectory units; SET and RESET averages in LSB; coil currents in mA; temperature in degC
POINT_FORMAT = "<hfffffffffffff"
POINT_BYTES = const(54)

_CRC_NIBBLES = (
    b"\x00\x00\x10\x21\x20\x42\x30\x63\x40\x84\x50\xa5\x60\xc6\x70\xe7"
    b"\x81\x08\x91\x29\xa1\x4a\xb1\x6b\xc1\x8c\xd1\xad\xe1\xce\xf1\xef"
)


def crc16(data):  # CCITT, polynomial 0x1021, start 0xFFFF, four bits at a time
    crc = 0xFFFF
    table = _CRC_NIBBLES
    for byte in data:
        i = (crc >> 12 ^ byte >> 4) * 2
        crc = (crc << 4 & 0xFFFF) ^ (table[i] << 8 | table[i + 1])
        i = (crc >> 12 ^ byte & 15) * 2
        crc = (crc << 4 & 0xFFFF) ^ (table[i] << 8 | table[i + 1])
    return crc


class Writer:
    def __init__(self, write):  # write takes bytes
        self._write = write
        self._sequence = 0

    def frame(self, kind, payload):
        body = struct.pack("<BH", kind, self._sequence) + payload
        self._sequence = (self._sequence + 1) & 0xFFFF
        self._write(b"$" + binascii.b2a_base64(body + struct.pack("<H", crc16(body))))

    def json(self, kind, fields):
        self.frame(kind, json.dumps(fields).encode())

    def event(self, t_s, code, name, text, values):
        self.json(EVENT, {"t_s": t_s, "code": code, "name": name, "text": text, "values": values})
