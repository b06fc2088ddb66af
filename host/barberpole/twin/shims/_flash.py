# _flash.py: the board's flash as a block device on an image file. Each call is one read or write of the file, so a
# killed interpreter leaves whole blocks behind, as losing power between two blocks does.
BLOCK = 512

_COUNT, _SIZE, _SYNC, _ERASE = 4, 5, 3, 6


class Flash:
    def __init__(self, path, on_write=None):
        self._file = open(path, "r+b")
        self._blocks = self._file.seek(0, 2) // BLOCK
        self._on_write = on_write

    def readblocks(self, block, into, offset=0):
        self._file.seek(block * BLOCK + offset)
        self._file.readinto(into)

    def writeblocks(self, block, data, offset=0):
        if self._on_write:
            self._on_write()
        self._file.seek(block * BLOCK + offset)
        self._file.write(data)

    def ioctl(self, op, arg):
        if op == _COUNT:
            return self._blocks
        if op == _SIZE:
            return BLOCK
        return 0
