# write_registers.py: the timed board's hardware set up, driven and switched off in MicroPython itself; prints every
# register write and pin as JSON. test_registers_written.py holds them against what the register model was given.
# Reads its fakes' names and addresses from stm.json; the generated modules are on the path.
import json
import sys

with open("stm.json") as file:
    setup = json.load(file)
names = setup["names"]
cells = {names["RCC"] + names["RCC_AHB1ENR"]: 0x00100000}
journal = []


class Memory:
    def __init__(self, size):
        self._size = size

    def __getitem__(self, address):
        if address == names["TIM8"] + names["TIM_CNT"]:
            return 65535  # has counted
        word = cells.get(address & ~3, 0)
        return word >> 8 * (address & 3) & (1 << 8 * self._size) - 1

    def __setitem__(self, address, value):
        if self._size != 4:
            shift, mask = 8 * (address & 3), (1 << 8 * self._size) - 1
            value = cells.get(address & ~3, 0) & ~(mask << shift) | (value & mask) << shift
        write(address & ~3, value)


def write(address, value):
    cells[address] = value
    journal.append((address, value))


class Stm:
    mem8, mem32 = Memory(1), Memory(4)

    def __getattr__(self, name):
        return names[name]


class Pin:
    IN, OUT, ALT, ANALOG, PULL_UP = 0, 1, 2, 3, 1

    def __init__(self, name, mode, pull=0, value=None, alt=0):
        self._name = name
        journal.append((name, mode, value, alt))

    def value(self, level):
        journal.append((self._name, 1, level, 0))


class Spi:  # a DAC80504 strapped as the board files ask
    def __init__(self, number, baudrate, polarity, phase):
        self._asked = b"\x00"

    def write_readinto(self, out, into):
        journal.append(("spi", list(out)))
        into[:] = {b"\x81": b"\x00\x04\x97", b"\x84": b"\x00\x00\x0f"}.get(self._asked, bytes(3))
        self._asked = bytes(out[:1])


class Timer:  # as MicroPython's timer.c writes the registers
    CENTER, PWM = 32, 0

    def __init__(self, number, prescaler=None, period=0, mode=0):
        self._number, self._at = number, names["TIM%d" % number]
        if prescaler is not None:
            write(self._at + names["TIM_CR1"], 0)
            for name, value in (("PSC", prescaler), ("ARR", period), ("EGR", 1), ("CR1", mode | 0x81)):
                write(self._at + names["TIM_" + name], value)

    def channel(self, number, mode, pulse_width):
        write(self._at + names["TIM_CCMR1" if number < 3 else "TIM_CCMR2"], 0x68 << 8 * (number - 1 & 1))
        write(self._at + names["TIM_CCR%d" % number], pulse_width)
        write(self._at + names["TIM_CCER"], 1 << 4 * (number - 1))

    def source_freq(self):
        return 168000000 if self._number == 8 else 84000000

    def deinit(self):
        for name in ("CR1", "CCER", "BDTR"):
            write(self._at + names["TIM_" + name], 0)


class Fake:
    def __init__(self, **content):
        for name, value in content.items():
            setattr(self, name, value)


sys.modules["stm"] = Stm()
sys.modules["pyb"] = Fake(Timer=Timer)
sys.modules["uctypes"] = Fake(addressof=lambda data: setup["ring"])
sys.modules["machine"] = Fake(Pin=Pin, SPI=Spi, disable_irq=lambda: True, enable_irq=lambda state: None)

import bp_board  # noqa: E402
from bp_hardware import Hardware  # noqa: E402

hardware = Hardware()
hardware.start()
hardware.dac.start(bp_board.DAC_GAIN if setup["spi_dac"] else 0)
hardware.coils.set(setup["codes"])
hardware.sampler.retime(setup["rate_hz"])
assert not hardware.flip.stopped() and not hardware.sampler._scan.silent()
hardware.off()
print(json.dumps(journal))
