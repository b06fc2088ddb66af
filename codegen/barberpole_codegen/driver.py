"""`barberpole build` for the coil-driver role: the trajectory as a flash-resident table, and the modules that play it.

The folder has the form of a sensor board's build, so that `flash` takes both.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from barberpole import mpy, paths
from barberpole.built import LISTING, MAIN, romfs_image, sha256
from barberpole.driver_board import Driver
from barberpole.trajectory import CodeTable, Trajectory, driver_table, for_driver

from barberpole_codegen import budget, image, parts, settings, ways
from barberpole_codegen.emit import Constant, module
from barberpole_codegen.folder import as_json, require_replaceable, write_folder
from barberpole_codegen.modules import VERSION, trajectory_text

FORMAT = 2
Progress = Callable[[str], None]
SHARED = (MAIN, "bp_ads131m08.py", "bp_coils.py", "bp_dac80504.py", "bp_native.py", "bp_reasons.py", "bp_records.py")
GENERATED = ("bp_board", "bp_trajectory")


@dataclass(frozen=True)
class DriverBuild:
    """What was built. `files`: path in the folder -> path on the board, relative to its working folder."""

    folder: Path
    build: str
    board: str
    trajectory: str
    files: dict[str, str]
    budget: dict[str, Any]


def build_driver(
    driver: Driver, out_dir: str | Path, trajectory: Trajectory | None = None, progress: Progress | None = None
) -> DriverBuild:
    """Build for a coil driver into `out_dir`, which is new, empty, or a former build; trajectory: another than its own.

    Raises InputError or LimitError; then nothing changed.
    """
    say, out_dir = progress or (lambda _: None), Path(out_dir)
    require_replaceable(out_dir)
    table = driver_table(trajectory or for_driver(driver), driver)
    sources = _sources(driver, table)
    build_hash = ways.build_hash(sources)
    sources[f"{ways.MARK}.py"] = ways.mark(sources, "", VERSION)
    say(f"compiling {len(sources) - 1} modules")
    names = sorted(name for name in sources if name != MAIN)
    compiled = {name.replace(".py", ".mpy"): mpy.compile_module(name, sources[name]) for name in names}
    rom = romfs_image(compiled)
    costs = _costs(driver, sources, compiled, rom)
    files = {f"mpy/{name}": f"lib/{name}" for name in compiled} | {f"src/{MAIN}": MAIN}
    content = {f"src/{name}": text.encode() for name, text in sources.items()}
    content |= {f"mpy/{name}": data for name, data in compiled.items()}
    content |= {"romfs.img": rom, "manifest.py": image.manifest(list(sources)).encode(), "budget.json": as_json(costs)}
    made = DriverBuild(out_dir, build_hash, driver.name, table.id, files, costs)
    content[LISTING] = as_json(_describe(made, content))
    write_folder(out_dir, content)
    say(f"built {out_dir}")
    return made


def _sources(driver: Driver, table: CodeTable) -> dict[str, str]:
    """Text by file name. The role is in bp_main, which main.py of both roles runs."""
    folder = paths.firmware()
    texts = {name: (folder / name).read_text() for name in SHARED}
    texts |= {path.name: path.read_text() for path in sorted((folder / "driver").glob("*.py"))}
    return texts | {"bp_board.py": board_text(driver), "bp_trajectory.py": trajectory_text(driver, table)}


def _costs(driver: Driver, sources: dict[str, str], compiled: dict[str, bytes], rom: bytes) -> dict[str, Any]:
    """budget.json. Raises LimitError where the files exceed the board's file system."""
    flash = budget.flash_bytes({**compiled, MAIN: sources[MAIN].encode()})
    sizes = {name: size for name, size in flash.items() if name != "total"}
    return {
        "ways": ways.figures(driver, sizes, len(rom), None),
        "flash_bytes": flash,
        "romfs_bytes": len(rom),
        "ram_on_import_bytes": budget.ram_on_import(rom, [*GENERATED]),
    }


def _describe(made: DriverBuild, content: dict[str, bytes]) -> dict[str, Any]:
    def entry(source: str, **more: str) -> dict[str, Any]:
        return {"source": source, **more, "bytes": len(content[source]), "sha256": sha256(content[source])}

    return {
        "format": FORMAT,
        "generator": f"barberpole_codegen {VERSION}",
        "build": made.build,
        "board": made.board,
        "role": "coil_driver",
        "model": "",
        "calibration": "",
        "trajectory": made.trajectory,
        "files": [entry(source, target=target) for source, target in sorted(made.files.items())],
        "romfs": entry("romfs.img"),
        "firmware": {},
    }


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
