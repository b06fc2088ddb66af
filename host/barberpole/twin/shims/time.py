# time.py: MicroPython's time module on the emulated board's clock.
import _twin
from _twin import PERIOD, TICKS_US, advance, ticks_ms, ticks_us
from utime import gmtime as _gmtime
from utime import localtime as _localtime
from utime import mktime

_HALF = PERIOD // 2
_START_S = 1420070400  # 1 January 2015, where this port's clock starts without a battery


def ticks_cpu():
    return (_twin.now + _twin._offset_us) * _twin.setup["cpu_mhz"] & (PERIOD - 1)


def ticks_add(ticks, delta):
    return ticks + delta & (PERIOD - 1)


def ticks_diff(end, start):
    return (end - start + _HALF & (PERIOD - 1)) - _HALF


def sleep_us(us):
    advance(us + TICKS_US if us > 0 else TICKS_US)


def sleep_ms(ms):
    sleep_us(1000 * ms)


def sleep(s):
    sleep_us(int(1000000 * s))


def time():
    return _START_S + _twin.now // 1000000


def time_ns():
    return 1000 * (_START_S * 1000000 + _twin.now)


def gmtime(s=None):
    return _gmtime(time() if s is None else s)


def localtime(s=None):
    return _localtime(time() if s is None else s)
