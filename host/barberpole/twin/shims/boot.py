# boot.py: what happens between power and prompt on the emulated board: its modules, its flash, then the user's files.
# Runs as the interpreter's script with -i, so the prompt follows. Leaves no names behind.


def _boot():
    import gc
    import sys

    import _flash
    import _twin
    import os
    import vfs

    for name in ("machine", "os", "time", "pyb", "stm"):  # later imports find these, whatever the path is then
        __import__(name)
        sys.modules["u" + name] = sys.modules[name]

    def charge():
        _twin.now += _twin.FLASH_US
        _twin.exchange(_twin.FLASH)

    flash = _flash.Flash(_twin.setup["image"], charge)
    vfs.umount("/")
    try:
        disk = vfs.VfsLfs2(flash)
    except OSError:
        vfs.VfsLfs2.mkfs(flash)
        disk = vfs.VfsLfs2(flash)
    vfs.mount(disk, "/")
    os.chdir("/")
    sys.path[:] = ["", ".frozen", "/lib"]
    for name in ("_flash", "boot"):
        sys.modules.pop(name, None)
    gc.collect()

    def run(path):
        try:
            with open(path) as file:
                code = compile(file.read(), path, "exec")
        except OSError:
            return
        except Exception as error:
            sys.print_exception(error)
            return
        try:
            exec(code, globals())
        except SystemExit:
            raise
        except BaseException as error:
            sys.print_exception(error)

    try:
        _twin.exchange(_twin.STARTED)
        run("boot.py")
        if not _twin.setup["raw"]:
            run("main.py")
    except KeyboardInterrupt:  # pressed before there was anything to interrupt
        pass


try:
    _boot()
finally:
    del _boot
    import _twin

    _twin.exchange(_twin.READY)
    del _twin
