# _start.py: what happens between power and prompt on the emulated board: its modules, its flash, the user's files.
import gc
import sys

import _rom
import _twin
import os
import vfs
from _flash import BLOCK, Flash

FILLER = "/full"
SLOTS = ("/bp/a.cal", "/bp/b.cal")
charged = True


def begin(names):  # runs boot.py and main.py in `names`, as a board does in those of the prompt
    provide_modules()
    mount_flash()
    gc.collect()
    try:
        _twin.exchange(_twin.STARTED)
        run("boot.py", names)
        if not _twin.setup["raw"]:  # a board in the raw prompt leaves main.py out after a soft reset
            run("main.py", names)
    except KeyboardInterrupt:  # pressed before there was anything to interrupt
        pass


def ready():
    _twin.exchange(_twin.READY)


def provide_modules():
    for name in ("machine", "os", "time", "pyb", "stm"):  # later imports find these, whatever the path is then
        __import__(name)
        sys.modules["u" + name] = sys.modules[name]


def mount_flash():
    flash = Flash(_twin.setup["image"], charge_write)
    folders = _rom.provide(charge_write)
    vfs.umount("/")
    try:
        disk = vfs.VfsLfs2(flash)
    except OSError:
        vfs.VfsLfs2.mkfs(flash)
        disk = vfs.VfsLfs2(flash)
    vfs.mount(disk, "/")
    os.chdir("/")
    spoil_flash(_twin.setup["flash_faults"])
    _rom.mount(folders)


def spoil_flash(faults):  # before the power comes: it costs no time
    global charged
    charged = False
    try:
        os.remove(FILLER)
    except OSError:  # there was none
        pass
    if "store_corrupt" in faults:
        for path in SLOTS:
            turn_a_bit(path)
    if "flash_full" in faults:
        fill()
    charged = True


def turn_a_bit(path):
    try:
        with open(path, "rb") as file:
            data = bytearray(file.read())
    except OSError:
        return
    data[len(data) // 2] ^= 4
    with open(path, "wb") as file:
        file.write(data)


def fill():
    for size in (BLOCK, 1):  # what is left of the last block would still hold a small file
        try:
            with open(FILLER, "ab") as file:
                while True:
                    file.write(bytes(size))
                    file.flush()
        except OSError:
            pass


def charge_write():
    if not charged:
        return
    _twin.now += _twin.FLASH_US
    _twin.exchange(_twin.FLASH)


def run(path, names):
    source = _rom.frozen_text(path)
    try:
        if source is None:
            with open(path) as file:
                source = file.read()
    except OSError:
        return
    try:
        exec(compile(source, path, "exec"), names)
    except SystemExit:
        raise
    except BaseException as error:
        sys.print_exception(error)
