"""The tables of boards/<board>.toml.

The docstring under each field gives its unit and meaning; `make docs` prints them.
"""

from typing import Annotated, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from barberpole.sensor import PerAxis, Sensor
from barberpole.tables import STRICT, Count, Fraction, Index, Integer, Name, NotNegative, Number, Positive, Yes


@dataclass(frozen=True, config=STRICT)
class Flip:
    """The pulses that set and reset the bridges."""

    set_pin: str
    """Pin whose pulse magnetises to SET."""
    reset_pin: str
    """Pin whose pulse magnetises to RESET."""
    rate_hz: Positive
    """Hz. Full cycles (SET and RESET) a second."""
    pulse_us: Positive
    """µs. Width of one pulse."""
    settle_us: NotNegative
    """µs. From the end of the pulse to the first sample: bridge and converter filter."""
    strap_supply_v: Positive
    """V. Supply of the strap driver."""
    capacitor_nf: Positive
    """nF. Capacitor in series with the three straps."""
    driver_ohm: NotNegative = 0.0
    """Ω. On-resistance of the driver and its wiring, in series with the straps."""
    timing: Literal["software", "hardware"] = "software"
    """Who times pulses and samples: the program, with a converter on SPI; or two timers, with the on-chip converter."""
    break_pin: str = ""
    """Pin of the kill loop (TIM8_BKIN): a wire to ground that stops the pulses when it opens. Empty: none."""
    dead_time_us: NotNegative = 1.0
    """µs. Least time between the end of a pulse and the beginning of the opposite one; with timing = "hardware"."""


@dataclass(frozen=True, config=STRICT)
class AdcChannels:
    """Which input of the converter carries what."""

    x: Index
    """Input of the x bridge."""
    y: Index
    """Input of the y bridge."""
    z: Index
    """Input of the z bridge."""
    bridge: Index
    """Input of the divided bridge voltage, from which the temperature follows."""
    coil_x: Index
    """Input of the x coil's shunt."""
    coil_y: Index
    """Input of the y coil's shunt."""
    coil_z: Index
    """Input of the z coil's shunt."""
    supply: Index
    """Input of the divided strap supply."""


@dataclass(frozen=True, config=STRICT)
class Adc:
    """The converter of bridges, coil currents and supplies."""

    part: Literal["ads131m08", "ads8688", "stm32f4_adc"]
    """Part, which names the firmware's driver; stm32f4_adc is the microcontroller's own."""
    sample_hz: Positive
    """Hz. Conversions a second, all channels at once."""
    samples_per_half: Count
    """Samples averaged after each pulse."""
    vref_v: Positive
    """V. Full scale at gain 1, both signs."""
    pga: Count
    """Gain of the bridge channels, in the converter or in amplifiers before it; the others run at 1."""
    bits: Count
    """Bits of one conversion."""
    bridge_divider: Fraction
    """Ratio from the bridge voltage to its input."""
    supply_divider: Fraction
    """Ratio from the strap supply to its input."""
    coil_shunt_ohm: Positive
    """Ω. Shunt in series with each coil."""
    channels: AdcChannels
    """Inputs; of ADC1 where the converter is the microcontroller's own."""
    spi: Index = 0
    """Number of the SPI bus; none for the on-chip converter."""
    cs_pin: str = ""
    """Chip-select pin, of a converter on SPI."""
    drdy_pin: str = ""
    """Data-ready pin, low when a conversion waits; of the ads131m08."""
    reset_pin: str = ""
    """Reset pin, active low; of the ads131m08."""
    baud: Index = 0
    """bit/s. Clock of the SPI bus."""
    sck_pin: str = ""
    """Clock pin of the bus, to be checked; MicroPython's own where empty."""
    miso_pin: str = ""
    """Data pin from the converter, to be checked."""
    mosi_pin: str = ""
    """Data pin to the converter, to be checked."""
    common_mode_v: Number = 0.0
    """V. Mean of the two outputs of a bridge against the converter's ground: 0 with a symmetric bridge feed."""
    ring_cycles: Index = 0
    """Flip cycles that the ring of samples holds; a pause of the program up to this long loses nothing."""

    @property
    def lsb_per_mv(self) -> float:
        """LSB/mV of a bridge channel."""
        return 2 ** (self.bits - 1) * self.pga / (1000.0 * self.vref_v)


@dataclass(frozen=True, config=STRICT)
class DacChannels:
    """Which output of the converter drives which coil."""

    coil_x: Index
    """Output to the x coil."""
    coil_y: Index
    """Output to the y coil."""
    coil_z: Index
    """Output to the z coil."""


@dataclass(frozen=True, config=STRICT)
class Dac:
    """The converter that drives the offset coils, around its mid scale."""

    part: Literal["dac80504", "stm32f4_dac"]
    """Part, which names the firmware's driver; stm32f4_dac is the microcontroller's own."""
    bits: Count
    """Bits of one code."""
    vref_v: Positive
    """V. Reference."""
    gain: Literal[1, 2]
    """Output gain: full scale is vref_v × gain."""
    channels: DacChannels
    """Outputs; of the stm32f4_dac 0 and 1 are the converter's (PA4, PA5), 2 is dac.pwm_pin."""
    spi: Index = 0
    """Number of the SPI bus; none for the on-chip converter."""
    cs_pin: str = ""
    """Chip-select pin, of a converter on SPI."""
    baud: Index = 0
    """bit/s. Clock of the SPI bus."""
    sck_pin: str = ""
    """Clock pin of the bus, to be checked; MicroPython's own where empty."""
    miso_pin: str = ""
    """Data pin from the converter, to be checked."""
    mosi_pin: str = ""
    """Data pin to the converter, to be checked."""
    pwm_pin: str = ""
    """Timer output that, through a low-pass filter, is the third output of the stm32f4_dac."""


@dataclass(frozen=True, config=STRICT)
class Coils:
    """The current through the offset coils."""

    full_scale_ma: PerAxis
    """mA. Coil current at the end of the DAC's scale, per axis."""
    max_ma: Positive
    """mA. Largest current that may be asked for."""
    series_ohm: Positive
    """Ω. Resistor in series with coil and shunt."""
    settle_us: NotNegative
    """µs. From a new code to a steady current."""


@dataclass(frozen=True, config=STRICT)
class Selfcal:
    """The run of coil currents at power-up, and when its result is believed."""

    trajectory: Literal["sphere"]
    """Shape of the run: antipodal pairs of points on spheres."""
    radii_ut: Annotated[tuple[Positive, ...], Field(min_length=1)]
    """µT. Radii of the spheres; two or more tell quadratic terms from the constant."""
    points: Annotated[Integer, Field(ge=8, multiple_of=2)]
    """Points of the run, in pairs."""
    settle_cycles: Index
    """Flip cycles dropped after each new current."""
    cycles_per_point: Count
    """Flip cycles averaged at each point."""
    gain_drift_limit: Fraction
    """Largest believable change of a gain since the factory calibration, relative."""
    current_tolerance: Fraction
    """Largest believable error of a coil current, relative."""
    ambient_step_limit_ut: Positive
    """µT. Largest change of the ambient field during the run."""
    residual_sigma: Positive
    """Largest residual, in standard deviations of the noise of a point."""


@dataclass(frozen=True, config=STRICT)
class Timing:
    """What MicroPython needs for its arithmetic, charged by the emulated board."""

    python_us_per_selfcal_point: NotNegative
    """µs. Compensation, least-squares row and frame of one point."""
    python_us_per_row: NotNegative
    """µs. Compensation and frame of one streamed row."""


@dataclass(frozen=True, config=STRICT)
class Member:
    """One sensor of an array."""

    name: str
    """Name, with which its columns begin."""
    position_mm: tuple[Number, Number, Number]
    """mm. Where it is, in the frame of the board."""
    cs_pin: str = ""
    """Chip-select pin of its converter; empty for the first sensor, whose converter is that of [adc]."""


@dataclass(frozen=True, config=STRICT)
class Board:
    """A board with its sensor. The keys of [board] stand here, the other tables are fields."""

    name: Name
    """Name of the file without .toml."""
    mcu: str
    """Microcontroller."""
    micropython_board: str
    """MicroPython's name of the board."""
    cpu_mhz: Positive
    """MHz. Core clock."""
    float_bits: Literal[32, 64]
    """Bits of a MicroPython float."""
    flash_kib: Count
    """KiB. Flash memory."""
    ram_kib: Count
    """KiB. RAM."""
    filesystem_kib: Count
    """KiB. Room for files."""
    shielded: Yes
    """Whether it powers up in a magnetic shield, so that the ambient field is known to be zero."""
    sensor: Sensor
    """Name of a sensor file."""
    flip: Flip
    adc: Adc
    dac: Dac
    coils: Coils
    selfcal: Selfcal
    timing: Timing
    watchdog_s: Annotated[float, Field(ge=0, le=32)] = 0.0
    """s. After so long without a sign of the program the board restarts; 0: never. In [board]."""
    members: tuple[Member, ...] = ()
    """Sensors of an array, as its file's [[array.sensors]] say; none on a board with one sensor."""

    @property
    def in_series(self) -> int:
        """Sensors whose straps and offset coils are in series: those of the array, or one."""
        return max(1, len(self.members))

    @property
    def scale_lsb_per_ut(self) -> float:
        """LSB/µT of a bridge at zero field and 25 °C, from the parts' nominal values."""
        return self.sensor.sensitivity_mv_per_v_per_ut * self.sensor.bridge_v * self.adc.lsb_per_mv
