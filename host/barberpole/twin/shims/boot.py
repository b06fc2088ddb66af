# boot.py: the interpreter's script, run with -i so that the prompt follows; leaves no names behind.
import _start

try:
    _start.begin(globals())
finally:
    _start.ready()
    del _start
