# bp_store.py: today's gains, kept over power cycles in two slots.
# Only the slot that is not in force is ever written, so whenever the power goes the other one is whole; a slot counts
# only if its check sum, its format and the calibration it belongs to are right, and the newest of those wins.
# With none, the factory calibration is in force: gains of 1.
# This holds for what a file system keeps of its promises: littlefs does; FAT, which a stock pyboard has, can lose other
# files of the same flash block when the power goes during an erase.
import binascii
import os
import struct

from micropython import const

FACTORY = "factory"
NAMES = ("slot a", "slot b")
_FILES = ("a.cal", "b.cal")
_MAGIC = b"bpc1"
_LAYOUT = "<4sI12s3f3f3ff"  # magic, seq, calibration, gain, shift, offset, temperature
_BYTES = const(60)
_NONE_THERE = const(2)  # ENOENT


class Stored:  # what is in force
    def __init__(self, where, seq, gain, shift_ut, offset_lsb, temp_c):
        self.where = where
        self.seq = seq
        self.gain = gain
        self.shift_ut = shift_ut
        self.offset_lsb = offset_lsb
        self.temp_c = temp_c


class Store:
    def __init__(self, folder, calibration, factory_offset_lsb):  # calibration: its hash, 12 characters
        self._folder = folder
        self._factory = Stored(FACTORY, 0, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), factory_offset_lsb, 0.0)
        self._calibration = calibration.encode()
        self.corrupt = ()  # names of slots that hold something that is no calibration
        self.foreign = ()  # names of slots that belong to another calibration

    def load(self):
        best = self._factory
        self.corrupt = self.foreign = ()
        for slot in range(2):
            found = self._read(slot)
            if found is not None and found.seq > best.seq:
                best = found
        return best

    def save(self, gain, shift_ut, offset_lsb, temp_c):  # returns what is in force now
        held = self.load()
        slot = 1 if held.where == NAMES[0] else 0
        body = struct.pack(_LAYOUT, _MAGIC, held.seq + 1, self._calibration, *gain, *shift_ut, *offset_lsb, temp_c)
        make_folder(self._folder)
        with open(self._path(slot), "wb") as file:
            file.write(body + struct.pack("<I", binascii.crc32(body)))
        sync()
        return self.load()  # read back: what cannot be read is not in force

    def clear(self):  # back to the factory calibration: the older slot goes first, so that it never comes back
        held = self.load()
        newer = NAMES.index(held.where) if held.where in NAMES else 0
        for slot in (1 - newer, newer):
            try:
                os.remove(self._path(slot))
            except OSError as error:
                if error.errno != _NONE_THERE:
                    raise
        sync()
        return self.load()

    def _path(self, slot):
        return self._folder + "/" + _FILES[slot]

    def _read(self, slot):
        try:
            with open(self._path(slot), "rb") as file:
                data = file.read()
        except OSError:
            return None
        body = data[:-4]
        if len(body) != _BYTES or struct.pack("<I", binascii.crc32(body)) != data[-4:] or body[:4] != _MAGIC:
            self.corrupt += (NAMES[slot],)
            return None
        fields = struct.unpack(_LAYOUT, body)
        if fields[2] != self._calibration:
            self.foreign += (NAMES[slot],)
            return None
        return Stored(NAMES[slot], fields[1], fields[3:6], fields[6:9], fields[9:12], fields[12])


def next_boot(folder):  # counts power-ups; begins again at 1 where the count is lost
    try:
        with open(folder + "/boot", "rb") as file:
            count = struct.unpack("<I", file.read())[0]
    except (OSError, ValueError):
        count = 0
    make_folder(folder)
    try:
        with open(folder + "/boot", "wb") as file:
            file.write(struct.pack("<I", count + 1))
    except OSError:
        pass  # no room: the same number comes again
    return count + 1


def replace(path, produce):  # a whole new file or the old one: produce(file) writes beside, then it is renamed
    with open(path + ".new", "wb") as file:
        produce(file)
    sync()
    os.rename(path + ".new", path)
    sync()


def make_folder(path):
    try:
        os.mkdir(path)
    except OSError:
        pass  # it is there already; if it cannot be made, opening a file in it says so


def sync():  # the cache of the flash otherwise waits for seconds
    if hasattr(os, "sync"):
        os.sync()
