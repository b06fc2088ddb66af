"""MicroPython's modules on top of an `Mcu`, and the firmware imported over them in CPython."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType, SimpleNamespace

from barberpole import paths

from registers.addresses import TIM, TIM2, TIM4, TIM8, stm_names
from registers.mcu import ALTERNATE, ANALOG, OUTPUT, UNITS_PER_US, Mcu

PERIOD = 1 << 30
CALL_UNITS = 170
SRAM = 0x2000_4000
TIMERS = {2: TIM2, 4: TIM4, 8: TIM8}
SOURCE_HZ = {2: 84_000_000, 4: 84_000_000, 8: 168_000_000}


def load(mcu: Mcu, pins: dict[str, str], *names: str) -> SimpleNamespace:
    """Firmware modules by name, talking to `mcu`; `pins` maps board names to port pins."""
    with _installed(_fakes(mcu, pins)):
        return SimpleNamespace(**{name: __import__(name) for name in names})


@contextmanager
def importable(mcu: Mcu, pins: dict[str, str], generated: dict[str, ModuleType], spi: type) -> Iterator[None]:
    """Firmware can be imported meanwhile, also by itself; `generated` modules by name, `spi` is machine.SPI."""
    fakes = _fakes(mcu, pins)
    fakes["machine"].__dict__["SPI"] = spi
    with _installed(fakes | generated):
        yield


@contextmanager
def _installed(fakes: dict[str, ModuleType]) -> Iterator[None]:
    kept = {name: sys.modules.pop(name) for name in list(sys.modules) if name in fakes or name.startswith("bp_")}
    sys.modules.update(fakes)
    sys.path.insert(0, str(paths.firmware()))
    try:
        yield
    finally:
        sys.path.remove(str(paths.firmware()))
        for name in [*fakes, *(n for n in sys.modules if n.startswith("bp_"))]:
            sys.modules.pop(name, None)
        sys.modules.update(kept)


def _module(name: str, **content: object) -> ModuleType:
    module = ModuleType(name)
    module.__dict__.update(content)
    return module


def _fakes(mcu: Mcu, pins: dict[str, str]) -> dict[str, ModuleType]:
    words = {f"mem{bits}": Memory(mcu, bits // 8) for bits in (8, 16, 32)}
    return {
        "micropython": _module("micropython", const=lambda value: value),
        "uctypes": _module("uctypes", addressof=lambda data: _place(mcu, data)),
        "stm": _module("stm", **stm_names(), **words),
        "machine": _module("machine", Pin=_pin_class(mcu, pins), **_interrupts(mcu)),
        "pyb": _module("pyb", Timer=_timer_class(mcu)),
        "time": _clock(mcu),
    }


def _place(mcu: Mcu, data: object) -> int:
    for address, held in mcu.memory.items():
        if held is data:
            return address
    address = SRAM + 0x1_0000 * len(mcu.memory)
    mcu.memory[address] = data
    return address


class Memory:
    """mem8, mem16 and mem32."""

    def __init__(self, mcu: Mcu, size: int):
        self._mcu, self._size = mcu, size

    def __getitem__(self, address: int) -> int:
        word = self._mcu.read(address & ~3)
        return word >> 8 * (address & 3) & (1 << 8 * self._size) - 1

    def __setitem__(self, address: int, value: int) -> None:
        if self._size == 4:
            return self._mcu.write(address, value)
        shift, mask = 8 * (address & 3), (1 << 8 * self._size) - 1
        word = self._mcu.cells.get(address & ~3, 0)
        return self._mcu.write(address & ~3, word & ~(mask << shift) | (value & mask) << shift)


def _clock(mcu: Mcu) -> ModuleType:
    def ticks_us() -> int:
        mcu.wait(CALL_UNITS)
        return mcu.now // UNITS_PER_US & PERIOD - 1

    def ticks_ms() -> int:
        mcu.wait(CALL_UNITS)
        return mcu.now // (1000 * UNITS_PER_US) & PERIOD - 1

    def ticks_diff(end: int, start: int) -> int:
        return (end - start + PERIOD // 2 & PERIOD - 1) - PERIOD // 2

    def ticks_add(ticks: int, delta: int) -> int:
        return ticks + delta & PERIOD - 1

    def sleep_us(us: int) -> None:
        mcu.wait(CALL_UNITS + us * UNITS_PER_US)

    return _module(
        "time", ticks_us=ticks_us, ticks_ms=ticks_ms, ticks_diff=ticks_diff, ticks_add=ticks_add, sleep_us=sleep_us
    )


def _interrupts(mcu: Mcu) -> dict[str, object]:
    def disable_irq() -> bool:
        before, mcu.interrupts = mcu.interrupts, False
        return before

    def enable_irq(state: bool = True) -> None:
        mcu.interrupts = state

    return {"disable_irq": disable_irq, "enable_irq": enable_irq}


def _pin_class(mcu: Mcu, pins: dict[str, str]) -> type:
    class Pin:
        IN, OUT, ALT, ANALOG = 0, OUTPUT, ALTERNATE, ANALOG
        PULL_UP, PULL_DOWN = 1, 2

        def __init__(self, name: str, mode: int, pull: int = 0, *, value: int | None = None, alt: int = 0):
            self._name = pins[name]
            mcu.pin(self._name, mode, value, alt)

        def value(self, level: int) -> None:
            mcu.pin(self._name, OUTPUT, level)

    return Pin


def _timer_class(mcu: Mcu) -> type:
    class Timer:  # as timer.c leaves the registers: running, updated once, outputs of a soft reset unknown
        UP, CENTER = 0, 32
        PWM = 0

        def __init__(self, number: int, *, prescaler: int | None = None, period: int = 0, mode: int = 0):
            self._number = number
            if prescaler is not None:
                at = TIMERS[number]
                mcu.write(at + TIM["CR1"], 0)
                for name, value in (("PSC", prescaler), ("ARR", period), ("EGR", 1), ("CR1", mode | 0x81)):
                    mcu.write(at + TIM[name], value)

        def channel(self, number: int, mode: int, *, pulse_width: int) -> None:
            at = TIMERS[self._number]
            mcu.write(at + TIM["CCMR1" if number < 3 else "CCMR2"], 0x68 << 8 * (number - 1 & 1))
            mcu.write(at + TIM[f"CCR{number}"], pulse_width)
            mcu.write(at + TIM["CCER"], 1 << 4 * (number - 1))

        def source_freq(self) -> int:
            return SOURCE_HZ[self._number]

        def deinit(self) -> None:
            at = TIMERS[self._number]
            for name in ("CR1", "CCER", "BDTR"):
                mcu.write(at + TIM[name], 0)

    return Timer
