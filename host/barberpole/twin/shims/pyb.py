# pyb.py: the parts of this port's own module that the emulated board has; none of the timers.
import _twin
from machine import SPI, Pin, disable_irq, enable_irq, freq, unique_id
from machine import reset as hard_reset
from time import sleep_ms as delay
from time import sleep_us as udelay
from time import ticks_ms as millis
from time import ticks_us as micros

__all__ = (
    "LED",
    "SPI",
    "USB_VCP",
    "Pin",
    "delay",
    "disable_irq",
    "enable_irq",
    "freq",
    "hard_reset",
    "micros",
    "millis",
    "udelay",
    "unique_id",
)


class LED:
    def __init__(self, id):
        self._lit = False

    def on(self):
        self._lit = True

    def off(self):
        self._lit = False

    def toggle(self):
        self._lit = not self._lit


class USB_VCP:
    def isconnected(self):
        return True


def elapsed_micros(start):
    return _twin.ticks_us() - start & (_twin.PERIOD - 1)
