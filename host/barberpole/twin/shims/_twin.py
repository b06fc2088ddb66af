# _twin.py: the clock of the emulated board and its wire to the physics. Runs inside MicroPython.
# Time is counted here and never taken from the PC. What the program does to pins is kept with its time and sent along
# with the next request; a request is answered with the time after it and with the moment of the next conversion.
# Words of 64 bits, both ways:
#   request: op | (bus | SPI mode << 4) << 8 | pin changes << 16 | bytes sent << 28 | bytes wanted << 44;  time in µs;
#            each pin change as time << 16 | pin << 8 | level;  the bytes sent
#   answer:  time in µs (its complement: Ctrl-C was pressed);  time of data-ready in µs;  the bytes wanted
import json
from array import array

import os

SYNC, SPI, FLASH, STARTED, READY, RESET, BITE = range(7)
NEVER = 1 << 60
PERIOD = 1 << 30  # ticks of this port wrap here

# What a call costs on the microcontroller in bytecode, µs: its own time and the interpreter's around it.
TICKS_US = 2
PIN_US = 2
SPI_US = 8
POLL_US = 10  # a look at a data-ready that will not come
FLASH_US = 2000  # programming one block; erasing is not charged

_MAX_CHANGES = 64
_SYNC_EVERY = 10000  # µs between requests while the program only computes and sleeps

setup = json.loads(os.getenv("BARBERPOLE_TWIN"))
_to = open(setup["to"], "wb")
_from = open(setup["from"], "rb")
_request = array("q", bytes(8 * (2 + _MAX_CHANGES)))
_answer = array("q", bytes(16))
_changes = 0
_ready = -1  # when data-ready is low; -1: not known, ask
_sync_at = 0
now = setup["now"]
_bite_at = 0  # when the watchdog restarts the board; 0: it does not run


def exchange(op, bus=0, out=None, into=None):
    global now, _changes, _ready, _sync_at
    sent = len(out) if out is not None else 0
    wanted = len(into) if into is not None else 0
    _request[0] = op | bus << 8 | _changes << 16 | sent << 28 | wanted << 44
    _request[1] = now
    _to.write(_request, 16 + 8 * _changes)
    _changes = 0
    if sent:
        _to.write(out)
    _from.readinto(_answer)
    if wanted:
        _from.readinto(into)
    now = _answer[0]
    _ready = _answer[1]
    interrupted = now < 0
    if interrupted:
        now = ~now
    if op != FLASH:  # whose answers bring no interrupt
        _sync_at = min(now + _SYNC_EVERY, setup["cut"])
    if interrupted:
        raise KeyboardInterrupt
    if 0 < _bite_at <= now and op != BITE:
        exchange(BITE)


def feed(us):  # the watchdog, which begins with the first meal
    global _bite_at
    _bite_at = now + us


def advance(us):
    global now
    now += us
    if now >= _sync_at:
        exchange(SYNC)


def ticks_us():
    global now
    now += TICKS_US
    if now >= _sync_at:
        exchange(SYNC)
    return now & (PERIOD - 1)


def pin_change(pin, level, paces):
    global now, _changes, _ready
    now += PIN_US
    _request[2 + _changes] = now << 16 | pin << 8 | level
    _changes += 1
    if paces:  # it changes when conversions come
        _ready = -1
    if _changes == _MAX_CHANGES:
        exchange(SYNC)


def data_ready():  # 1: not yet. A program that looks again has nothing else to do, so the clock goes on to the edge
    global now
    now += PIN_US
    if _ready < 0:
        exchange(SYNC)
    if now >= _ready:
        return 0
    if _ready == NEVER:
        advance(POLL_US)
    else:
        now = _ready
    return 1


def transfer(bus, bits_per_s, out, into, size):
    advance(SPI_US)
    exchange(SPI, bus, out, into)
    advance((8000000 * size + bits_per_s - 1) // bits_per_s)
