# bp_records.py: what the board says, as frames that a reader can trust one by one.
# A frame is one line of text: "$", then base64 of type (1 byte), sequence (uint16), payload, and CRC-16 over the
# three, all little-endian. A damaged frame fails its check sum and is dropped by the reader; a lost one leaves a gap
# in the sequence. The header frame names the columns, so a log explains itself. It begins a power-up with sequence 0
# and is repeated now and then for readers that join later: any other sequence says that the power-up goes on.
import binascii
import json
import struct

from micropython import const

from bp_native import crc16

HEADER = const(72)  # "H": JSON
ROW = const(68)  # "D": packed as the header's columns say
EVENT = const(69)  # "E": JSON
RUN = const(84)  # "T": JSON, a coil run begins
POINT = const(80)  # "P": packed as POINT_FORMAT
RESULT = const(83)  # "S": JSON, the verdict on the run
ANSWER = const(65)  # "A": JSON, to a command
FORMAT = const(1)

# index; ux uy uz in trajectory units; SET and RESET averages in LSB; coil currents in mA; temperature in degC
POINT_FORMAT = "<hfffffffffffff"
POINT_BYTES = const(54)


class Writer:
    def __init__(self, write):  # write takes bytes
        self._write = write
        self._sequence = 0

    def frame(self, kind, payload):
        body = struct.pack("<BH", kind, self._sequence) + payload
        self._sequence = (self._sequence + 1) & 0xFFFF
        self._write(b"$" + binascii.b2a_base64(body + struct.pack("<H", crc16(body, len(body)))))

    def row(self, fast, sums, limbs):  # by a bp_fast.FastRow; False where it lies outside what that can do
        line = fast.line(sums, limbs, self._sequence)
        if line is None:
            return False
        self.line(line)
        return True

    def again(self, frame):  # a bp_frame.Frame
        self.line(frame.sealed(self._sequence))

    def line(self, text):
        self._sequence = (self._sequence + 1) & 0xFFFF
        self._write(text)

    def json(self, kind, fields):
        self.frame(kind, json.dumps(fields).encode())

    def event(self, t_s, code, name, text, values):
        self.json(EVENT, {"t_s": t_s, "code": code, "name": name, "text": text, "values": values})


def content(line):  # the payload of a frame that this board wrote, None where it is not whole
    try:
        body = binascii.a2b_base64(line.strip()[1:])
    except ValueError:
        return None
    if len(body) < 5 or struct.unpack("<H", body[-2:])[0] != crc16(body, len(body) - 2):
        return None
    return body[3:-2]
