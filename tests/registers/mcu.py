"""Clock, bus and pins of the microcontroller; timers and converter beside it."""

from collections.abc import Iterator

from registers.addresses import GPIO, GPIO_PORTS, RCC, TIM2, TIM8
from registers.converter import Converter
from registers.timers import FlipTimer

UNITS_PER_US = 168
ACCESS_UNITS = 150  # a register access in bytecode, 0.9 µs
TIM_AF = 3  # TIM8 at its pins
INPUT, OUTPUT, ALTERNATE, ANALOG = range(4)


class Mcu:
    """Registers by address, time in 1/168 µs. `outputs` names the pins whose levels are kept: {"PC6": 1, "PC7": 2}."""

    def __init__(self, outputs: dict[str, int], pauses: Iterator[tuple[int, int]] | None = None):
        self.now = 0
        self.cells: dict[int, int] = {RCC + 0x30: 0x0010_0000}  # only the core-coupled memory has a clock
        self.journal: list[tuple[int, int, int]] = []
        self.levels: dict[str, list[tuple[int, int | None]]] = {name: [(0, None)] for name in outputs}
        self.memory: dict[int, object] = {}
        self.interrupts = True
        self._outputs = outputs
        self._pauses = pauses or iter(())
        self._pause = next(self._pauses, None)
        self._done = 0
        self.tim8 = FlipTimer(self)
        self.converter = Converter(self)

    def wait(self, units: int) -> None:
        """Time goes by, and a pause of the program where one is due: a collection, an interrupt."""
        self.now += units
        while self._pause and self.interrupts and self.now >= self._pause[0]:
            self.now += self._pause[1]
            self._pause = next(self._pauses, None)

    def read(self, address: int) -> int:
        """A register as the program sees it."""
        self.wait(ACCESS_UNITS)
        for part in (self.tim8, self.converter):
            value = part.read(address)
            if value is not None:
                return value
        return self.cells.get(address, 0)

    def write(self, address: int, value: int) -> None:
        """The program writes a register."""
        self.wait(ACCESS_UNITS)
        self.catch_up()
        self.journal.append((self.now, address, value))
        if not self.tim8.write(address, value) and not self.converter.write(address, value):
            self.cells[address] = value
        self._note_levels()

    def catch_up(self) -> None:
        """What hardware has done since the last write."""
        for name, channel in self._outputs.items():
            if self._driven_by_timer(name):
                self.levels[name] += self.tim8.edges(channel, self._done, self.now)
        self._done = self.now
        self.converter.catch_up(self.now)

    def break_input(self) -> None:
        """The kill loop opens."""
        self.catch_up()
        self.tim8.kill()
        self._note_levels()

    def pin(self, name: str, mode: int, level: int | None = None, af: int = 0) -> None:
        """What a pin constructor does to the port's registers: level and function first, mode last."""
        port, number = GPIO_PORTS[name[1]], int(name[2:])
        if level is not None:
            self.write(port + 0x14, self.cells.get(port + 0x14, 0) & ~(1 << number) | level << number)
        if mode == ALTERNATE:
            at, shift = port + 0x20 + 4 * (number // 8), 4 * (number % 8)
            self.write(at, self.cells.get(at, 0) & ~(15 << shift) | af << shift)
        moder = self.cells.get(port, 0)
        self.write(port, moder & ~(3 << 2 * number) | mode << 2 * number)

    def mode(self, name: str) -> int:
        """Of a pin, from MODER."""
        return self.cells.get(GPIO_PORTS[name[1]], 0) >> 2 * int(name[2:]) & 3

    def _driven_by_timer(self, name: str) -> bool:
        port, number = GPIO_PORTS[name[1]], int(name[2:])
        af = self.cells.get(port + 0x20 + 4 * (number // 8), 0) >> 4 * (number % 8) & 15
        return self.mode(name) == ALTERNATE and af == TIM_AF

    def _note_levels(self) -> None:
        for name, channel in self._outputs.items():
            level: int | None = None  # floating
            if self._driven_by_timer(name):
                level = self.tim8.level(channel, self.now)
            elif self.mode(name) == OUTPUT:
                level = self.cells.get(GPIO_PORTS[name[1]] + 0x14, 0) >> int(name[2:]) & 1
            if self.levels[name][-1][1] != level:
                self.levels[name].append((self.now, level))


def written(mcu: Mcu, address: int) -> list[int]:
    """All values written to a register, in order."""
    return [value for _, at, value in mcu.journal if at == address]


__all__ = ["ALTERNATE", "ANALOG", "GPIO", "OUTPUT", "TIM2", "TIM8", "UNITS_PER_US", "Mcu", "written"]
