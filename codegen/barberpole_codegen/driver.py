"""`barberpole build` for the coil-driver role: the trajectory as a flash-resident table, and the modules that play it.

The folder has the form of a sensor board's build, so that `flash` takes both.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from barberpole import paths
from barberpole.built import MAIN
from barberpole.driver_board import Driver
from barberpole.trajectory import CodeTable, Trajectory, driver_table, for_driver

from barberpole_codegen import budget, parts, settings
from barberpole_codegen.emit import Constant, module
from barberpole_codegen.folder import require_replaceable
from barberpole_codegen.modules import VERSION, trajectory_text
from barberpole_codegen.roles import Compiled, Head, RoleBuild, room, write_role

Progress = Callable[[str], None]
SHARED = (MAIN, "bp_ads131m08.py", "bp_coils.py", "bp_dac80504.py", "bp_native.py", "bp_reasons.py", "bp_records.py")
GENERATED = ("bp_board", "bp_trajectory")


def build_driver(
    driver: Driver, out_dir: str | Path, trajectory: Trajectory | None = None, progress: Progress | None = None
) -> RoleBuild:
    """Build for a coil driver into `out_dir`, which is new, empty, or a former build; trajectory: another than its own.

    Raises InputError or LimitError; then nothing changed.
    """
    say, out_dir = progress or (lambda _: None), Path(out_dir)
    require_replaceable(out_dir)
    table = driver_table(trajectory or for_driver(driver), driver)
    head = Head(driver.role, driver.name, "", "", table.id)
    return write_role(out_dir, head, _sources(driver, table), partial(_costs, driver), say)


def _sources(driver: Driver, table: CodeTable) -> dict[str, str]:
    """Text by file name. The role is in bp_main, which main.py of both roles runs."""
    folder = paths.firmware()
    texts = {name: (folder / name).read_text() for name in SHARED}
    texts |= {path.name: path.read_text() for path in sorted((folder / "driver").glob("*.py"))}
    return texts | {"bp_board.py": board_text(driver), "bp_trajectory.py": trajectory_text(driver, table)}


def _costs(driver: Driver, made: Compiled) -> dict[str, Any]:
    """budget.json. Raises LimitError where the files exceed the board's file system."""
    return room(driver, made) | {"ram_on_import_bytes": budget.ram_on_import(made.rom, [*GENERATED])}


def board_text(driver: Driver) -> str:
    """bp_board.py of a coil driver."""
    title = "bp_board.py: what is soldered."
    return module(title, f"coil driver {driver.name}", VERSION, constants=driver_constants(driver))


def driver_constants(driver: Driver) -> list[Constant]:
    """What is soldered, in the firmware's units; the last constant is the hash of all others."""
    adc, drive, c = driver.adc, driver.drive, driver.adc.channels
    parts.require_frame_time(adc.baud, adc.sample_hz)
    lsb_per_v = float(1 << (adc.bits - 1)) / adc.vref_v
    constants = [
        Constant("BOARD", driver.name),
        Constant("ADC_SPI", adc.spi),
        Constant("ADC_BAUD", adc.baud),
        Constant("ADC_CS_PIN", adc.cs_pin),
        Constant("ADC_DRDY_PIN", adc.drdy_pin),
        Constant("ADC_RESET_PIN", adc.reset_pin),
        Constant("ADC_RATIO_CODE", parts.ratio_code(adc.sample_hz), f"{adc.sample_hz:g} conversions a second"),
        Constant("ADC_CHANNELS", (c.coil_x, c.coil_y, c.coil_z)),
        Constant("COIL_MA_PER_LSB", settings.narrowed((1000.0 / (adc.coil_shunt_ohm * lsb_per_v),))[0]),
        Constant("SAMPLES", driver.samples, "conversions averaged for a row"),
        Constant("DAC_SPI", driver.dac.spi),
        Constant("DAC_BAUD", driver.dac.baud),
        Constant("DAC_CS_PIN", driver.dac.cs_pin),
        Constant("DAC_GAIN", driver.dac.gain),
        Constant("DAC_CHANNELS", (driver.dac.channels.coil_x, driver.dac.channels.coil_y, driver.dac.channels.coil_z)),
        Constant(
            "FULL_SCALE_MA", settings.narrowed(driver.coils.full_scale_ma), "coil current at the end of the scale"
        ),
        Constant(
            "UT_PER_MA", settings.narrowed(driver.coils.ut_per_ma), "said in the header; the host reckons with it"
        ),
        Constant("HOLD_US", round(1000 * drive.hold_ms)),
        Constant("SETTLE_US", round(1000 * drive.settle_ms)),
    ]
    return [*constants, Constant("HASH", settings.digest(constants), "of all of the above")]
