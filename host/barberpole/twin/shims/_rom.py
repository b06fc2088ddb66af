# _rom.py: what another firmware than the stock one brings to the board: a ROMFS partition, and modules in the firmware
# itself. The partition is NOR flash in one sector: writing clears bits, only erasing sets them. Frozen modules cannot
# be had here, as the interpreter is not built anew: a read-only image stands in for them, at /.frozen, in their place
# in sys.path. Its code is loaded as from ROMFS.
import sys

import _twin
import vfs

_SEGMENTS, _SEGMENT, _PREPARE, _WRITE, _COMPLETE, _SECTOR = 1, 2, 3, 4, 5, 6
_WORD = 16
_EINVAL = -22
_ROM, _FROZEN = "/rom", "/.frozen"


class Partition:  # `import vfs` gives this: the module with what the port adds to it
    def __init__(self, path, on_write):
        self._file = open(path, "r+b")
        self._size = self._file.seek(0, 2)
        self._file.seek(0)
        self.content = bytearray(self._size)
        self._file.readinto(self.content)
        self._on_write = on_write

    def __getattr__(self, name):
        return getattr(vfs, name)

    def rom_ioctl(self, op, segment=0, *rest):
        if op == _SEGMENTS:
            return 1
        if segment != 0:
            return _EINVAL
        if op == _SEGMENT:
            return memoryview(self.content)
        if op == _SECTOR:
            return self._size
        if op == _PREPARE:
            return self._erase(*rest)
        if op == _WRITE:
            return self._program(*rest)
        return _EINVAL  # completing is nothing to do on this port, and answered so

    def _erase(self, *place):
        if sum(place) > self._size:
            return _EINVAL
        for at in range(self._size):
            self.content[at] = 0xFF
        self._store(0, self.content)
        return _WORD

    def _program(self, at, data):
        if at + len(data) > self._size:
            return _EINVAL
        for byte in data[: len(data) // 4 * 4]:
            self.content[at] &= byte
            at += 1
        self._store(at - len(data), memoryview(self.content)[at - len(data) : at])
        return 0

    def _store(self, at, data):
        self._on_write()
        self._file.seek(at)
        self._file.write(data)


def provide(on_write):  # returns the folders for sys.path, behind the working folder
    folders = [".frozen"]
    if _twin.setup["frozen"]:
        with open(_twin.setup["frozen"], "rb") as file:
            image = file.read()
        folders.append((image, _FROZEN))
    if _twin.setup["romfs"]:
        partition = Partition(_twin.setup["romfs"], on_write)
        sys.modules["vfs"] = partition
        folders.append((partition.content, _ROM))
    return folders


def mount(folders):  # after the flash is the root; an image that is not whole is left out, as the port does
    path = [""]
    for folder in folders:
        if isinstance(folder, str):
            path.append(folder)
            continue
        content, point = folder
        try:
            vfs.mount(vfs.VfsRom(memoryview(content)), point)
        except OSError:
            continue
        path += [point, point + "/lib"] if point == _ROM else [point + "/lib"]
    path.append("/lib")
    sys.path[:] = path


def frozen_text(path):  # a frozen main program runs instead of a file
    if not _twin.setup["frozen"]:
        return None
    try:
        with open(_FROZEN + "/lib/" + path) as file:
            return file.read()
    except OSError:
        return None
