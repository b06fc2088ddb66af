# main.py: runs when the board starts. All it does is in bp_main; a board without it falls through to the REPL.
import os


def finish_update(folder):  # the power went while whole new files were being moved to their places
    try:
        names = os.listdir(folder)
    except OSError:  # no update
        return
    if "ready" not in names:  # it did not arrive whole: what runs stays
        return
    for name in names:
        if name != "ready":
            os.rename(folder + "/" + name, name if name == "main.py" else "lib/" + name)
    os.remove(folder + "/ready")
    os.rmdir(folder)


try:
    finish_update("lib/bp.new")
    import bp_main
except (ImportError, OSError, ValueError) as error:  # a module is missing, or made for another MicroPython
    print("barberpole is not complete on this board:", error)
else:
    bp_main.run()
