"""The board's wiring: pins and buses of the microcontroller to strap driver, converters and coils.

Also charges the time that MicroPython's arithmetic takes on the real microcontroller (the board file's [timing]): of a
self-calibration point when its coil currents change, of a streamed row after the last sample of its RESET half.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from barberpole.board import Board
from barberpole.twin.ads131m08 import Ads131m08
from barberpole.twin.analog import AnalogInputs, noise_level
from barberpole.twin.array_world import ArrayWorld
from barberpole.twin.dac80504 import Dac80504
from barberpole.twin.faults import of_sensor
from barberpole.twin.frames import FRAME_BYTES, NOTHING, Ahead
from barberpole.twin.noise import Noise
from barberpole.twin.pins import PINS, bus_number
from barberpole.twin.sensor_head import AXES, SensorHead
from barberpole.twin.world import World

SET, RESET = 1, -1
STEP_DELAY_S = 0.2  # ambient_step: after the coils were first driven
KEPT_INCIDENTS = 100
MAGNETISATION = 1 << 40  # its random numbers are none of the noise's, which count blocks from 0
SEED_STEP = 1 << 44  # from one sensor of an array to the next
FLOATING = 0xFF  # what a bus reads where nothing answers


class Soldered:
    """Everything on the board but the microcontroller, from power-up on. Times are µs since then."""

    def __init__(self, board: Board, world: World | ArrayWorld, seed: int, power_up: int, faults: frozenset[str]):
        self.board, self.faults = board, faults
        worlds = world.worlds if isinstance(world, ArrayWorld) else (world,)
        self.sensors = [
            Sensing(board, one, seed + SEED_STEP * index, power_up, of_sensor(faults, index))
            for index, one in enumerate(worlds)
        ]
        self.head, self._adc = self.sensors[0].head, self.sensors[0].adc
        self._coil_of = {getattr(board.dac.channels, f"coil_{name}"): axis for axis, name in enumerate(AXES)}
        self._driven_at: float | None = None
        self._flip = FlipDriver(board, self)
        self._point_charged = True
        self._row_samples = -1  # counted from a RESET pulse on; -1: none is due
        self._charge_us = 0
        self.incidents: list[str] = []
        self._dac = Dac80504(board.dac.vref_v, board.dac.gain == 2, self._on_coil)
        self._buses = {bus_number(board.adc.spi): [], bus_number(board.dac.spi): []}
        self._wire()

    def _wire(self) -> None:
        board, flip = self.board, self._flip
        self._selected: dict[int, bool] = {}
        self._on_pin = {
            PINS.index(board.flip.set_pin): partial(flip.pin, SET),
            PINS.index(board.flip.reset_pin): partial(flip.pin, RESET),
            PINS.index(board.adc.reset_pin): self._reset_adcs,
        }
        selects = [board.adc.cs_pin, *(member.cs_pin for member in board.members[1:])]
        adcs = [(sensor.adc, name, board.adc.spi) for sensor, name in zip(self.sensors, selects, strict=True)]
        for chip, name, spi in (*adcs, (self._dac, board.dac.cs_pin, board.dac.spi)):
            pin = PINS.index(name)
            self._selected[pin] = False
            if chip is not self._dac or "dac_silent" not in self.faults:
                self._buses[bus_number(spi)].append((pin, chip))
            self._on_pin[pin] = partial(self._select, pin, chip)

    def pin(self, t_us: int, pin: int, level: int) -> None:
        """An output of the microcontroller has changed."""
        act = self._on_pin.get(pin)
        if act:
            act(t_us, level)

    def release_pins(self, t_us: int) -> None:
        """The microcontroller resets: its pins float, pulled to where nothing happens."""
        for name in (self.board.flip.set_pin, self.board.flip.reset_pin):
            self.pin(t_us, PINS.index(name), 0)
        for pin in (*self._selected, PINS.index(self.board.adc.reset_pin)):
            self.pin(t_us, pin, 1)

    def _reset_adcs(self, t_us: int, level: int) -> None:
        for sensor in self.sensors:
            sensor.adc.reset_pin(t_us, level)

    def transfer(self, t_us: int, bus: int, data: bytes) -> bytes:
        """Bytes over an SPI bus (`bus_number`), to the chip that is selected there and speaks its mode."""
        for pin, chip in self._buses.get(bus, ()):
            if self._selected[pin]:
                answer = chip.exchange(t_us, data)
                if self._row_samples >= 0 and chip is self._adc:
                    self._count_samples([self._adc.delivered_us])
                return answer
        return bytes((FLOATING,)) * len(data)

    def ready_at(self, t_us: int) -> int:
        """When the converter's data-ready goes low, µs."""
        return self._adc.ready_at(t_us)

    def ahead(self, most: int) -> Ahead:
        """Frames that the converter will say next, up to the one that ends a row.

        None of an array: its converters are read in turn.
        """
        if self.board.members or not self._selected[PINS.index(self.board.adc.cs_pin)]:
            return NOTHING
        told = self._adc.ahead(most)
        if self._row_samples < 0:
            return told
        old = told.count - self._settled(self._adc.coming_us(told.count))
        left = old + self.board.adc.samples_per_half - self._row_samples
        if left > told.count:
            return told
        row_us = round(self.board.timing.python_us_per_row)
        return Ahead(told.ready_us[: left + 2], told.frames[: left * FRAME_BYTES], row_us)

    def take(self, count: int) -> None:
        """So many of them were read."""
        if self._row_samples >= 0:
            self._count_samples(self._adc.coming_us(count))
        self._adc.take(count)

    def take_charge_us(self) -> int:
        """Time that arithmetic has taken since the last call, µs."""
        charge, self._charge_us = self._charge_us, 0
        return charge

    def truth(self, t_us: int) -> dict:
        """What is hidden, and what went wrong."""
        found = [sensor.truth(t_us) for sensor in self.sensors]
        names = [member.name for member in self.board.members]
        truth = {"sensors": dict(zip(names, found, strict=True))} if names else found[0]
        return {"time_s": t_us * 1e-6} | truth | {"incidents": list(self.incidents)}

    def note(self, t_us: float, what: str) -> None:
        """Keep an incident for `truth`."""
        if len(self.incidents) < KEPT_INCIDENTS:
            self.incidents.append(f"{t_us * 1e-6:.6f} s: {what}")

    def magnetise(self, t_us: float, state: int) -> None:
        """A strap pulse has ended that was long and strong enough."""
        for sensor in self.sensors:
            sensor.change(t_us, partial(sensor.head.magnetise, state))

    def pulsed(self, state: int) -> None:
        """Bookkeeping of the arithmetic's time: a pulse of this polarity begins."""
        if state == SET and self._row_samples >= 0:
            self._charge_row()
        self._point_charged = False
        idle = not any(self.head.current_ma)
        self._row_samples = 0 if state == RESET and idle else -1

    def _select(self, pin: int, chip: Ads131m08 | Dac80504, t_us: int, level: int) -> None:
        if self._selected[pin] == (not level):
            return
        self._selected[pin] = not level
        if level:
            chip.deselect(t_us)
        else:
            chip.select()

    def _on_coil(self, t_us: float, channel: int, volts: float) -> None:
        axis = self._coil_of.get(channel)
        if axis is None:
            return
        half_v = 0.5 * self.board.dac.vref_v * self.board.dac.gain
        first, *others = self.sensors
        first.change(t_us, partial(first.head.drive, axis, volts / half_v - 1.0))
        for sensor in others:  # in series: the same current
            sensor.change(t_us, partial(sensor.head.carry, axis, self.head.current_ma[axis]))
        if not self._point_charged:
            self._point_charged = True
            self._charge_us += round(self.board.timing.python_us_per_selfcal_point)
        if self._driven_at is None and any(self.head.current_ma):
            self._driven_at = t_us * 1e-6
            if "ambient_step" in self.faults:
                for sensor in self.sensors:
                    sensor.head.jump_field(self._driven_at + STEP_DELAY_S)

    def _settled(self, ends_us: list[float]) -> int:
        """How many of the conversions that end then belong to the row: those after settling."""
        settled_us = self._flip.last_us + self.board.flip.settle_us
        return sum(end_us >= settled_us for end_us in ends_us)

    def _count_samples(self, ends_us: list[float]) -> None:
        self._row_samples += self._settled(ends_us)
        if self._row_samples >= self.board.adc.samples_per_half:
            self._charge_row()

    def _charge_row(self) -> None:
        self._charge_us += round(self.board.timing.python_us_per_row)
        self._row_samples = -1


class Sensing:
    """One sensor with the converter that reads it."""

    def __init__(self, board: Board, world: World, seed: int, power_up: int, faults: frozenset[str]):
        magnetisation = np.random.default_rng((seed, power_up, MAGNETISATION)).choice((SET, RESET), 3).tolist()
        self.head = SensorHead(board, world, magnetisation, faults)
        self._noise = noise_level(board, world)
        self._inputs = AnalogInputs(self.head, Noise(self._noise, seed, power_up))
        self.adc = Ads131m08(self._inputs, board.adc.vref_v, faults)

    def change(self, t_us: float, act: Callable[[], None]) -> None:
        """Do `act` to the head; what was converted before has not seen it."""
        self.adc.catch_up(t_us)
        self._inputs.change(t_us, act)

    def truth(self, t_us: int) -> dict:
        """What is hidden of it."""
        return self.head.truth(t_us * 1e-6, self._noise.white_v.__getitem__)


class FlipDriver:
    """The strap driver's two inputs: which pulses flip the bridges, and which are mistakes."""

    def __init__(self, board: Board, soldered: Soldered):
        self._board, self._soldered = board, soldered
        self._high_since: dict[int, float | None] = {SET: None, RESET: None}
        self._spoiled = False
        self.last_us = 0.0

    def pin(self, state: int, t_us: float, level: int) -> None:
        """One of the two pins changes."""
        since = self._high_since[state]
        if level and since is None:
            self._rise(state, t_us)
        elif not level and since is not None:
            self._high_since[state] = None
            self._fall(state, t_us, t_us - since)

    def _rise(self, state: int, t_us: float) -> None:
        self._high_since[state] = t_us
        self._spoiled = self._high_since[-state] is not None
        if self._spoiled:
            self._soldered.note(t_us, "both flip pins are high: the driver shorts its supply")
        self._soldered.pulsed(state)

    def _fall(self, state: int, t_us: float, width_us: float) -> None:
        sensor = self._board.sensor
        self.last_us = t_us
        if self._spoiled:
            return
        if width_us < sensor.strap_pulse_us_min:
            self._soldered.note(t_us, f"a pulse of {width_us:g} µs is too short to flip")
        elif self._soldered.head.strap_a < sensor.strap_current_a:
            self._soldered.note(t_us, f"a pulse of {self._soldered.head.strap_a:.2f} A is too weak to flip")
        else:
            self._soldered.magnetise(t_us, state)
