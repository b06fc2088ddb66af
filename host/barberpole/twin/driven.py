"""The emulated coil driver: converters, power amplifier, coils and shunts, with the microcontroller's pins and buses.

The coils are copper: their resistance follows the temperature, and with a voltage across them so does the current. That
is why the currents are read back (thesis 6.1.2.1).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from barberpole.driver_board import Driver
from barberpole.twin.ads131m08 import Ads131m08
from barberpole.twin.analog import CONVERTER_NOISE_V, AnalogInputs
from barberpole.twin.dac80504 import Dac80504
from barberpole.twin.frames import NOTHING, Ahead
from barberpole.twin.noise import Noise, NoiseLevel
from barberpole.twin.pins import PINS, bus_number
from barberpole.twin.sensor_head import AXES, INPUTS
from barberpole.twin.temperature import Constant, Temperature

COPPER_PER_C = 0.00393
T0_C = 25.0
FLOATING = 0xFF  # what a bus reads where nothing answers
Triple = tuple[float, float, float]


@dataclass(frozen=True)
class CoilWorld:
    """What the coils really are: one believable specimen."""

    temperature: Temperature = field(default_factory=Constant)
    resistance_spread: Triple = (1.004, 0.993, 1.011)
    """Coil resistance at 25 °C over the nominal one."""
    constant_spread: Triple = (1.0, 1.0, 1.0)
    """Coil constant over that of the driver file; what a reference magnetometer would find."""

    def current_ma(self, driver: Driver, axis: int, share: float, t_s: float) -> float:
        """Current in mA of a coil at `share` (-1..1) of the driver's full voltage."""
        coils, shunt_ohm = driver.coils, driver.adc.coil_shunt_ohm
        warm = 1.0 + COPPER_PER_C * (float(self.temperature.temp_c(np.array([t_s]))[0]) - T0_C)
        nominal = coils.coil_ohm[axis] + shunt_ohm
        actual = coils.coil_ohm[axis] * self.resistance_spread[axis] * warm + shunt_ohm
        return share * coils.full_scale_ma[axis] * nominal / actual


class DrivenCoils:
    """State of the coils: the share of full scale on each. The converter's inputs see the shunts."""

    def __init__(self, driver: Driver, world: CoilWorld, faults: frozenset[str]):
        self.driver, self.world, self.faults = driver, world, faults
        self.share = [0.0, 0.0, 0.0]
        self.still_s = (0.0, 0.0)

    def drive(self, axis: int, share: float) -> None:
        """Put a share of the full voltage across a coil."""
        self.share[axis] = 0.0 if f"coil_open_{AXES[axis]}" in self.faults else share

    def current_ma(self, t_s: float) -> list[float]:
        """Currents of the three coils, mA."""
        return [self.world.current_ma(self.driver, axis, self.share[axis], t_s) for axis in range(3)]

    def volts(self, t_s: float) -> list[float]:
        """Voltage on every input of the converter, without noise."""
        self.still_s = (t_s, self.world.temperature.constant_until(t_s))
        volts, channels = [0.0] * INPUTS, self.driver.adc.channels
        for name, current_ma in zip(AXES, self.current_ma(t_s), strict=True):
            volts[getattr(channels, f"coil_{name}")] = 1e-3 * current_ma * self.driver.adc.coil_shunt_ohm
        return volts

    def coming(self, times_s: Sequence[float]) -> list[list[float]]:
        """Voltages at times to come."""
        return [self.volts(t_s) for t_s in times_s]


class Wired:
    """Everything on the driver but its microcontroller, as `Soldered` is of a sensor board. Times in µs."""

    def __init__(self, driver: Driver, world: CoilWorld, seed: int, power_up: int, faults: frozenset[str]):
        self._driver = driver
        self.coils = DrivenCoils(driver, world, faults)
        level = NoiseLevel((CONVERTER_NOISE_V,) * INPUTS, (0.0,) * INPUTS, 1.0 / driver.adc.sample_hz)
        self._inputs = AnalogInputs(self.coils, Noise(level, seed, power_up))
        self._adc = Ads131m08(self._inputs, driver.adc.vref_v, faults)
        self._axis_of = {getattr(driver.dac.channels, f"coil_{name}"): axis for axis, name in enumerate(AXES)}
        self._dac = Dac80504(driver.dac.vref_v, driver.dac.gain == 2, self._on_output)
        self._chips = {driver.adc.cs_pin: self._adc, driver.dac.cs_pin: self._dac}
        self._bus = {driver.adc.cs_pin: bus_number(driver.adc.spi), driver.dac.cs_pin: bus_number(driver.dac.spi)}
        self._selected = dict.fromkeys(self._chips, False)
        self._on_pin: dict[int, Callable[[int, int], None]] = {PINS.index(driver.adc.reset_pin): self._adc.reset_pin}
        self._on_pin |= {PINS.index(name): partial(self._select, name) for name in self._chips}
        self._silent = {driver.dac.cs_pin} if "dac_silent" in faults else set()

    def pin(self, t_us: int, pin: int, level: int) -> None:
        """An output of the microcontroller has changed."""
        act = self._on_pin.get(pin)
        if act:
            act(t_us, level)

    def release_pins(self, t_us: int) -> None:
        """The microcontroller resets: its pins float, pulled to where nothing happens."""
        for name in (*self._chips, self._driver.adc.reset_pin):
            self.pin(t_us, PINS.index(name), 1)

    def transfer(self, t_us: int, bus: int, data: bytes) -> bytes:
        """Bytes over an SPI bus, to the chip that is selected there."""
        for name, chip in self._chips.items():
            if self._selected[name] and self._bus[name] == bus and name not in self._silent:
                return chip.exchange(t_us, data)
        return bytes((FLOATING,)) * len(data)

    def ready_at(self, t_us: int) -> int:
        """When the converter's data-ready goes low, µs."""
        return self._adc.ready_at(t_us)

    def ahead(self, most: int) -> Ahead:
        """Frames that the converter will say next."""
        return self._adc.ahead(most) if self._selected[self._driver.adc.cs_pin] else NOTHING

    def take(self, count: int) -> None:
        """So many of them were read."""
        self._adc.take(count)

    def take_charge_us(self) -> int:
        """Its arithmetic fits into the hold, which is timed."""
        return 0

    def truth(self, t_us: int) -> dict:
        """The coils' currents now, and the field they make."""
        current_ma = self.coils.current_ma(t_us * 1e-6)
        spread = self.coils.world.constant_spread
        constants = [k * s for k, s in zip(self._driver.coils.ut_per_ma, spread, strict=True)]
        field_ut = [k * ma for k, ma in zip(constants, current_ma, strict=True)]
        return {"time_s": t_us * 1e-6, "coil_ma": current_ma, "ut_per_ma": constants, "field_ut": field_ut}

    def _select(self, name: str, t_us: int, level: int) -> None:
        if self._selected[name] == (not level):
            return
        self._selected[name] = not level
        if level:
            self._chips[name].deselect(t_us)
        else:
            self._chips[name].select()

    def _on_output(self, t_us: float, channel: int, volts: float) -> None:
        axis = self._axis_of.get(channel)
        if axis is None:
            return
        half_v = 0.5 * self._driver.dac.vref_v * self._driver.dac.gain
        self._adc.catch_up(t_us)
        self._inputs.change(t_us, partial(self.coils.drive, axis, volts / half_v - 1.0))
