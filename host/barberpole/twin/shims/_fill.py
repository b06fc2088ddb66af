# _fill.py: copies files of the PC into a flash image. Runs in a MicroPython of its own, before the board has power.
import json

import os
import vfs
from _flash import Flash

_CHUNK = 4096


def make_folders(path):
    at = path.find("/", 1)
    while at > 0:
        try:
            os.mkdir("/flash" + path[:at])
        except OSError:  # it is there
            pass
        at = path.find("/", at + 1)


def copy(source, path):
    make_folders(path)
    with open(source, "rb") as read, open("/flash" + path, "wb") as write:
        while chunk := read.read(_CHUNK):
            write.write(chunk)


job = json.loads(os.getenv("BARBERPOLE_FILL"))
flash = Flash(job["image"])
try:
    disk = vfs.VfsLfs2(flash)
except OSError:
    vfs.VfsLfs2.mkfs(flash)
    disk = vfs.VfsLfs2(flash)
vfs.mount(disk, "/flash")
for path, source in job["files"].items():
    copy(source, path if path.startswith("/") else "/" + path)
vfs.umount("/flash")
