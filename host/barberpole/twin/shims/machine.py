# machine.py: the parts of MicroPython's machine module that the emulated board has.
import sys

import _twin

PWRON_RESET, HARD_RESET, WDT_RESET, DEEPSLEEP_RESET, SOFT_RESET = 1, 2, 3, 4, 0

_levels = {}


class Pin:
    IN, OUT, OPEN_DRAIN, ALT, ALT_OPEN_DRAIN, ANALOG = 0, 1, 17, 2, 18, 3
    PULL_NONE, PULL_UP, PULL_DOWN = 0, 1, 2
    IRQ_RISING, IRQ_FALLING = 1, 2

    def __init__(self, id, mode=-1, pull=-1, *, value=None, alt=-1, af=-1):
        name = id.name() if isinstance(id, Pin) else id
        if name not in _twin.setup["pins"]:
            raise ValueError("Pin(%s) doesn't exist" % name)
        self._name = name
        self._number = _twin.setup["pins"].index(name)
        self._paces = name == _twin.setup["adc_reset"]
        self._is_ready = name == _twin.setup["drdy"]
        self._pull = pull
        self.init(mode, pull, value=value)

    def init(self, mode=-1, pull=-1, *, value=None, alt=-1, af=-1):
        if pull != -1:
            self._pull = pull
        if value is not None:
            self.value(value)

    def value(self, level=None):
        if level is not None:
            level = 1 if level else 0
            _levels[self._number] = level
            _twin.pin_change(self._number, level, self._paces)
            return None
        if self._is_ready:
            return _twin.data_ready()
        _twin.advance(_twin.PIN_US)
        return _levels.get(self._number, 1 if self._pull == Pin.PULL_UP else 0)

    def __call__(self, level=None):
        return self.value(level)

    def on(self):
        self.value(1)

    def off(self):
        self.value(0)

    high, low = on, off

    def toggle(self):
        self.value(not _levels.get(self._number, 0))

    def name(self):
        return self._name

    def __repr__(self):
        return "Pin(%s)" % self._name


class SPI:
    MSB, LSB = 0, 1
    CONTROLLER, MASTER = 0, 0

    def __init__(self, id, baudrate=1000000, **options):
        if str(id) not in _twin.setup["spi_clock_hz"]:
            raise ValueError("SPI(%s) doesn't exist" % id)
        self._id = id
        self._clock_hz = _twin.setup["spi_clock_hz"][str(id)]
        self.init(baudrate, **options)

    def init(self, baudrate=1000000, *, polarity=0, phase=0, bits=8, firstbit=0, sck=None, mosi=None, miso=None):
        divider = 2  # the prescaler is a power of two, and the clock never faster than asked for
        while self._clock_hz // divider > baudrate and divider < 256:
            divider *= 2
        self._baud = self._clock_hz // divider
        self._bus = self._id | (polarity << 1 | phase) << 4

    def deinit(self):
        pass

    def write(self, out):
        _twin.transfer(self._bus, self._baud, out, None, len(out))

    def readinto(self, into, write=0):
        out = bytes((write,)) * len(into) if write else None
        _twin.transfer(self._bus, self._baud, out, into, len(into))

    def read(self, size, write=0):
        into = bytearray(size)
        self.readinto(into, write)
        return bytes(into)

    def write_readinto(self, out, into):
        if len(out) != len(into):
            raise ValueError("buffers must be the same length")
        _twin.transfer(self._bus, self._baud, out, into, len(out))

    def __repr__(self):
        return "SPI(%d, baudrate=%d)" % (self._id, self._baud)


class Signal:
    def __init__(self, pin, *options, invert=False):
        self._pin = pin if isinstance(pin, Pin) else Pin(pin, *options)
        self._invert = invert

    def value(self, level=None):
        if level is None:
            return self._pin.value() ^ self._invert
        return self._pin.value(bool(level) ^ self._invert)

    def on(self):
        self.value(1)

    def off(self):
        self.value(0)


class _Memory:  # addresses of the microcontroller: kept, but nothing is behind them
    def __init__(self):
        self._cells = {}

    def __getitem__(self, address):
        return self._cells.get(address, 0)

    def __setitem__(self, address, value):
        self._cells[address] = value


mem8, mem16, mem32 = _Memory(), _Memory(), _Memory()


def disable_irq():
    return True


def enable_irq(state=True):
    pass


def unique_id():
    return _twin.setup["uid"].encode()


def freq(*hz):
    cpu = 1000000 * _twin.setup["cpu_mhz"]
    return None if hz else (cpu, cpu, cpu // 4, cpu // 2)


def idle():
    _twin.advance(1000)


def lightsleep(ms=0):
    _twin.advance(1000 * ms)


class WDT:
    def __init__(self, id=0, timeout=5000):
        if not 1 <= timeout <= 32760:
            raise ValueError("timeout out of range")
        self._us = 1000 * timeout
        self.feed()

    def feed(self):
        _twin.feed(self._us)


def reset_cause():
    return _twin.setup["cause"]


def reset():
    _twin.exchange(_twin.RESET)


def soft_reset():
    sys.exit()
