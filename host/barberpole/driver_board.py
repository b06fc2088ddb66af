"""The second board role, `coil_driver`: boards/drivers/<driver>.toml, read and checked (thesis 6.1.2.1).

driver = load_driver("imcs_driver")
driver.coils.ut_per_ma, driver.drive.hold_ms, driver_table(driver)

The docstring under each field gives its unit and meaning; `make docs` prints them.
"""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from barberpole import paths
from barberpole.board import find_file
from barberpole.board_tables import Dac
from barberpole.errors import InputError, LimitError, must
from barberpole.sensor import PerAxis
from barberpole.tables import STRICT, Count, Index, Name, NotNegative, Positive, read_toml, unknown, validate

ROLE = "coil_driver"
TABLES = ("adc", "dac", "coils", "drive")
FULL_SCALE_TOLERANCE = 0.01  # resistors of one per cent
AXES = "xyz"
SHARE = 0.5  # of the steady part of a hold that is read; the rest leaves room for arithmetic and the frame
MOST_SAMPLES = 100  # of 24 bits, within 30 bits and a sign


@dataclass(frozen=True, config=STRICT)
class DriverChannels:
    """Which input of the converter carries which coil's shunt."""

    coil_x: Index
    """Input of the x coil's shunt."""
    coil_y: Index
    """Input of the y coil's shunt."""
    coil_z: Index
    """Input of the z coil's shunt."""


@dataclass(frozen=True, config=STRICT)
class DriverAdc:
    """The converter that reads the coil currents back."""

    part: Literal["ads131m08"]
    """Part, which names the firmware's driver."""
    spi: Count
    """Number of the SPI bus."""
    cs_pin: str
    """Chip-select pin."""
    drdy_pin: str
    """Data-ready pin, low when a conversion waits."""
    reset_pin: str
    """Reset pin, active low."""
    baud: Count
    """bit/s. Clock of the SPI bus."""
    sample_hz: Positive
    """Hz. Conversions a second, all channels at once."""
    vref_v: Positive
    """V. Full scale at gain 1, both signs."""
    bits: Count
    """Bits of one conversion."""
    coil_shunt_ohm: Positive
    """Ω. Shunt in series with each coil."""
    channels: DriverChannels
    """Inputs."""


@dataclass(frozen=True, config=STRICT)
class HelmholtzCoils:
    """The three pairs of coils and their power amplifier."""

    ut_per_ma: PerAxis
    """µT/mA. Coil constant, per axis."""
    coil_ohm: PerAxis
    """Ω. Both loops of an axis in series."""
    amplifier_gain: Positive
    """Voltage gain between converter and coil."""
    full_scale_ma: PerAxis
    """mA. Coil current at the end of the DAC's scale, per axis."""
    max_ma: Positive
    """mA. Largest current that may be asked for."""


@dataclass(frozen=True, config=STRICT)
class Drive:
    """What is played: a table of currents, over and over."""

    trajectory: Literal["sphere"]
    """Shape, unless a build is given another."""
    radii_ut: Annotated[tuple[Positive, ...], Field(min_length=1)]
    """µT. Radii of the spheres."""
    points: Count
    """Points of the trajectory."""
    hold_ms: Positive
    """ms. How long each point is held; one row is logged for it."""
    settle_ms: NotNegative
    """ms. From a new code to a steady field."""


@dataclass(frozen=True, config=STRICT)
class Driver:
    """A board that drives coils. The keys of [board] stand here, the other tables are fields."""

    name: Name
    """Name of the file without .toml."""
    role: Literal["coil_driver"]
    """What the board is for."""
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
    adc: DriverAdc
    dac: Dac
    coils: HelmholtzCoils
    drive: Drive

    @property
    def samples(self) -> int:
        """Conversions averaged for a row; their sum stays within MicroPython's small integers."""
        steady_s = 1e-3 * (self.drive.hold_ms - self.drive.settle_ms)
        return min(int(SHARE * steady_s * self.adc.sample_hz), MOST_SAMPLES)


def load_driver(name_or_path: str | Path) -> Driver:
    """A coil driver by name ("imcs_driver") or path. Raises InputError or LimitError."""
    path = find_file(name_or_path, paths.boards() / "drivers", "coil driver")
    tables = read_toml(path, "the driver file")
    head = tables.pop("board", None)
    if not isinstance(head, dict) or head.get("role") != ROLE:
        raise InputError(must("board.role", f'"{ROLE}"', "another or none", path))
    for name in tables:
        if name not in TABLES:
            raise InputError(unknown(name, ("board", *TABLES), "the driver file", path))
    driver = validate(Driver, {**head, **tables}, "the driver file", path, "board.")
    check_driver(driver, path)
    return driver


def is_driver(name_or_path: str | Path) -> bool:
    """Whether this names a coil driver and no sensor board."""
    if not str(name_or_path).endswith(".toml"):
        return (paths.boards() / "drivers" / f"{name_or_path}.toml").is_file()
    head = read_toml(Path(name_or_path), "the board file").get("board")
    return isinstance(head, dict) and head.get("role") == ROLE


def check_driver(driver: Driver, where: object = "") -> None:
    """Whether the parts can do what the file asks. Raises LimitError (InputError for pins) with both figures."""
    if driver.dac.part != "dac80504" or not (driver.dac.spi and driver.dac.cs_pin and driver.dac.baud):
        raise InputError(must("dac", "a dac80504 with spi, cs_pin and baud", driver.dac.part, where))
    pins = (driver.adc.cs_pin, driver.adc.drdy_pin, driver.adc.reset_pin, driver.dac.cs_pin)
    if len(set(pins)) < len(pins):
        raise InputError(must("the pins of adc and dac", "four different ones", ", ".join(pins), where))
    for table, channels in (("adc", driver.adc.channels), ("dac", driver.dac.channels)):
        used = [channels.coil_x, channels.coil_y, channels.coil_z]
        most = 7 if table == "adc" else 3
        if len(set(used)) < 3 or max(used) > most:
            raise InputError(must(f"{table}.channels", f"three different ones up to {most}", used, where))
    _check_currents(driver, where)
    if driver.samples < 1:
        got = f"{driver.drive.hold_ms:g} ms after {driver.drive.settle_ms:g} ms of settling"
        raise LimitError(must("drive.hold_ms", "long enough to read the currents", got, where))


def _check_currents(driver: Driver, where: object) -> None:
    coils, adc = driver.coils, driver.adc
    half_v = 0.5 * driver.dac.vref_v * driver.dac.gain * coils.amplifier_gain
    for axis, full, ohm in zip(AXES, coils.full_scale_ma, coils.coil_ohm, strict=True):
        have = 1000.0 * half_v / (ohm + adc.coil_shunt_ohm)
        if abs(full - have) > FULL_SCALE_TOLERANCE * full:
            be = f"{have:.4g} mA, ±{half_v:g} V over coil and shunt of {ohm + adc.coil_shunt_ohm:g} Ω"
            raise LimitError(must(f"coils.full_scale_ma of {axis}", be, f"{full:g} mA", where))
        shunt_v = 1e-3 * full * adc.coil_shunt_ohm
        if shunt_v > adc.vref_v:
            raise LimitError(must("the shunt's voltage", f"at most {adc.vref_v:g} V", f"{shunt_v:.3g} V", where))
    if coils.max_ma > min(coils.full_scale_ma):
        be = f"at most {min(coils.full_scale_ma):g} mA, the end of the DAC's scale"
        raise LimitError(must("coils.max_ma", be, f"{coils.max_ma:g} mA", where))
