# The board's front end in a few lines, for the programs beside this one.
import time

from machine import SPI, Pin

set_pin = Pin("Y1", Pin.OUT, value=0)
reset_pin = Pin("Y2", Pin.OUT, value=0)
cs = Pin("X5", Pin.OUT, value=1)
ready = Pin("X4", Pin.IN)
spi = SPI(1, baudrate=8000000, polarity=0, phase=1)
dac_cs = Pin("Y5", Pin.OUT, value=1)
dac_spi = SPI(2, baudrate=8000000, polarity=0, phase=1)
frame = bytearray(30)
null = bytes(30)


def command(word, data=0):
    out = bytearray(30)
    out[0], out[1], out[3], out[4] = word >> 8, word & 255, data >> 8, data & 255
    cs.value(0)
    spi.write_readinto(out, frame)
    cs.value(1)


def register(address):
    command(0xA000 | address << 7)
    command(0)
    return frame[0] << 8 | frame[1]


def start():
    command(0x6000 | 2 << 7, 0x0110)
    command(0x6000 | 3 << 7, 0xFF0A)  # 8 kHz
    command(0x6000 | 4 << 7, 0x0444)  # bridges at gain 16


def read():
    while ready.value():
        pass
    cs.value(0)
    spi.write_readinto(null, frame)
    cs.value(1)
    return [word(channel) for channel in range(8)]


def word(channel):
    at = 3 + 3 * channel
    value = frame[at] << 16 | frame[at + 1] << 8 | frame[at + 2]
    return value - ((value & 0x800000) << 1)


def pulse(pin, us=8):
    pin.value(1)
    time.sleep_us(us)
    pin.value(0)


def mean(count=8):
    time.sleep_us(500)
    for _ in range(2):
        read()
    sums = [0] * 8
    for _ in range(count):
        sums = [a + b for a, b in zip(sums, read())]
    return [value / count for value in sums]


def coil(channel, code):
    dac_cs.value(0)
    dac_spi.write(bytes((8 + channel, code >> 8, code & 255)))
    dac_cs.value(1)
