# _twin.py: the clock of the emulated board and its wire to the physics. Runs inside MicroPython.
# Time is counted here and never taken from the PC. What the program does to pins is kept with its time and sent along
# with the next request; a request is answered with the time after it and with the moment of the next conversion.
# Words of 64 bits, both ways:
#   request: op | frames taken << 4 | (bus | SPI mode << 4) << 8 | pin changes << 16 | bytes sent << 28 |
#            bytes wanted << 44;  time in µs;  each pin change as time << 16 | pin << 8 | level;  the bytes sent
#   answer:  time in µs (its complement: Ctrl-C was pressed);  time of data-ready in µs;  number of frames ahead | µs of
#            arithmetic after the last of them << 4;  the bytes wanted;  the frames' times of data-ready and two more of
#            those;  the frames
# Frames ahead are what the converter says next if nothing but its chip select moves. A read that finds what such a
# frame is for is answered from it, without a request; the next request says how many were taken.
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
_FRAME = 30  # bytes of a frame of the converter
_NULL = bytes(_FRAME)
_MOST = 15  # frames ahead
_SYNC_EVERY = 10000  # µs between requests while the program only computes and sleeps

setup = json.loads(os.getenv("BARBERPOLE_TWIN"))
_to = open(setup["to"], "wb")
_from = open(setup["from"], "rb")
_request = array("q", bytes(8 * (2 + _MAX_CHANGES)))
_answer = array("q", bytes(24))
_changes = 0
_ready = -1  # when data-ready is low; -1: not known, ask
_sync_at = 0
now = setup["now"]
_offset_us = -setup["wrap"] & PERIOD - 1
_offset_ms = -(setup["wrap"] // 1000) & PERIOD - 1
_bite_at = 0  # when the watchdog restarts the board; 0: it does not run


class _Whole:  # a slice that need not be made anew
    def __getitem__(self, found):
        return found


_WHOLE = _Whole()[:]
_readies = array("q", bytes(8 * (_MOST + 2)))
_frames = bytearray(_FRAME * _MOST)
_ready_parts = tuple([memoryview(_readies)[: n + 2] for n in range(_MOST + 1)])
_frame_parts = tuple([memoryview(_frames)[: _FRAME * n] for n in range(_MOST + 1)])
_frame = tuple([memoryview(_frames)[_FRAME * n : _FRAME * (n + 1)] for n in range(_MOST)])
_ahead = _taken = 0  # frames there, and used
_charge = 0  # when the last is
_ahead_bus = -1
_select, _deselect = setup["adc_cs"] << 8, setup["adc_cs"] << 8 | 1


def exchange(op, bus=0, out=None, into=None):
    global now, _changes, _ready, _sync_at, _ahead, _taken, _ahead_bus, _charge
    sent = len(out) if out is not None else 0
    wanted = len(into) if into is not None else 0
    _request[0] = op | _taken << 4 | bus << 8 | _changes << 16 | sent << 28 | wanted << 44
    _request[1] = now
    _to.write(_request, 16 + 8 * _changes)
    _changes = 0
    if sent:
        _to.write(out)
    _from.readinto(_answer)
    if wanted:
        _from.readinto(into)
    _taken, _ahead, _ahead_bus = 0, _answer[2] & 0xF, bus
    _charge = _answer[2] >> 4
    if _ahead:
        _from.readinto(_ready_parts[_ahead])
        _from.readinto(_frame_parts[_ahead])
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
    return now + _offset_us & PERIOD - 1


def ticks_ms():
    advance(TICKS_US)
    return now // 1000 + _offset_ms & PERIOD - 1


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
    if not (_taken < _ahead and bus == _ahead_bus and take(out, into)):
        exchange(SPI, bus, out, into)
    advance((8000000 * size + bits_per_s - 1) // bits_per_s)


def take(out, into):  # whether this read is the one that the next frame ahead is for
    global now, _changes, _taken, _ready
    if _changes != 2 or _request[2] & 0xFFFF != _deselect or _request[3] & 0xFFFF != _select:
        return False
    if into is None or len(into) != _FRAME or not _readies[_taken] <= now < _readies[_taken + 2]:
        return False
    if out is not None and out != _NULL:
        return False
    into[_WHOLE] = _frame[_taken]
    _changes = 0
    _taken += 1
    _ready = _readies[_taken]
    if _taken == _ahead:
        now += _charge
    return True
