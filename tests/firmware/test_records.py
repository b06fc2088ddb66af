"""Frames as the board writes them, read by the host; and the table of reasons that both share."""

import json
import math
import struct

import numpy as np
import pytest
from barberpole import reasons, records
from barberpole.errors import InputError

SCRIPT = """
import sys
import bp_records as r
from bp_points import Points
w = r.Writer(sys.stdout.buffer.write)
w.json(r.HEADER, {"format": 1, "columns": [["t_s", "q", 1e-6]]})
w.frame(r.ROW, b"\\x01\\x02\\x03\\x04\\x05\\x06\\x07\\x08")
p = Points(2)
for k in range(2):
    p.put([0.5, -1.0, k], [1e6, 2, 3, 4, 5, 6], [1.5, 2.5, 3.5], 25.25)
    w.frame(r.POINT, p.packed(k))
w.event(1.5, 2, "ambient_step", "It moved.", {})
print(r.crc16(b"123456789", 9))
"""


@pytest.fixture(scope="module")
def printed(micropython):
    return micropython(SCRIPT)


def test_host_reads_every_frame(printed):
    stream = records.decode(printed.encode())
    assert (stream.damaged, stream.lost) == (0, 0)
    assert [f.type for f in stream.frames] == ["H", "D", "P", "P", "E"]
    assert [f.sequence for f in stream.frames] == [0, 1, 2, 3, 4]
    assert stream.frames[1].payload == bytes(range(1, 9))
    assert stream.frames[4].json["name"] == "ambient_step"


def test_points_keep_their_layout(printed):
    second = records.decode(printed.encode()).frames[3].payload
    assert records.POINT.size == len(second)
    wanted = (1, 0.5, -1.0, 1.0, 1e6, 2, 3, 4, 5, 6, 1.5, 2.5, 3.5, 25.25)
    assert records.POINT.unpack(second) == wanted


def test_crc_is_the_catalogued_one(printed):
    assert printed.splitlines()[-1] == str(0x29B1)  # CRC-16/CCITT-FALSE of "123456789"


def test_board_and_host_share_their_reasons(micropython):
    script = """
import json
import bp_reasons as r
names = {k: getattr(r, k) for k in dir(r) if k.isupper() and k != "TABLE"}
print(json.dumps([r.TABLE, names]))
"""
    table, codes = json.loads(micropython(script))
    assert [tuple(row) for row in table] == [(r.name, r.text) for r in reasons.TABLE]
    assert codes == {r.name.upper(): r.code for r in reasons.TABLE}


def test_reasons_can_be_read():
    assert reasons.reason(2).name == "ambient_step"
    assert reasons.sentence([]) == "Nothing is wrong."
    assert "current" in reasons.sentence([5, 3])
    with pytest.raises(InputError, match="reason code"):
        reasons.reason(99)


def test_point_in_float32_loses_less_than_a_tenth_of_an_lsb():
    largest = 900_000.0  # 150 µT at 6000 LSB/µT
    assert abs(struct.unpack("<f", struct.pack("<f", largest + 1 / 16))[0] - largest - 1 / 16) < 0.1
    assert math.isclose(np.spacing(np.float32(largest)), 0.0625)
