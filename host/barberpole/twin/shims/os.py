# os.py: the unix module, with what a board has besides.
from uos import *


def sync():
    pass


def uname():
    return ("pyboard", "pyboard", "1.29.0", "barberpole twin", "PYBv1.1 with STM32F405RG (emulated)")
