# bp_points.py: the points of a coil run, packed as they go into the record frames: 54 bytes each, allocated once.
# Solving reads the packed float32 values back, so host and board work on the very same numbers.
import struct

from bp_records import POINT_BYTES, POINT_FORMAT


class Points:
    def __init__(self, count):
        self.count = 0  # points put so far, in order
        self._data = bytearray(POINT_BYTES * count)

    def put(self, unit, means_lsb, coil_ma, temp_c):  # three, six, three and one number
        at = self.count * POINT_BYTES
        struct.pack_into(POINT_FORMAT, self._data, at, self.count, *unit, *means_lsb, *coil_ma, temp_c)
        self.count += 1

    def get(self, index):  # index, 3 currents in units, 6 averages, 3 currents in mA, temperature
        return struct.unpack_from(POINT_FORMAT, self._data, index * POINT_BYTES)

    def packed(self, index):
        return self._data[index * POINT_BYTES : (index + 1) * POINT_BYTES]
