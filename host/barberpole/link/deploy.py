"""Put a build on a board, by the way that the board takes, and make sure that what arrived is what was built."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from barberpole import mpy
from barberpole.built import MAIN, Built, for_processor, read_built, sha256
from barberpole.errors import InputError, must
from barberpole.link import mpremote
from barberpole.link.arriving import arriving
from barberpole.link.asking import BoardState, ask
from barberpole.link.installing import clear, install
from barberpole.link.romfs import write_image
from barberpole.link.ways import AUTO, FROZEN, MPY, ROMFS, Strays, choose, strays

RUN_FILE = "bp/run.bpr"  # the coil run and verdict of the last power-up, as bp_main writes it

NO_STRAYS = Strays((), ())

Say = Callable[[str], None]


@dataclass(frozen=True)
class Flashed:
    """What came of it. `reasons`: sentences on why the board does not run this build; none: it does."""

    port: str
    way: str
    build: str
    calibration: str
    sha256: dict[str, str]
    """Of each file, and of "romfs" where that way was taken, compared on the board."""
    copied: tuple[str, ...] = ()
    romfs_bytes_written: int = 0
    strays: Strays = NO_STRAYS
    reasons: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether the board runs this build."""
        return not self.reasons


def flash(folder: Path, port: str, say: Say = lambda _: None, way: str = AUTO, remove_shadows: bool = False) -> Flashed:
    """Put a build on a board, verify it there, and restart the board.

    What is there already is not copied again, so an interrupted flash is simply repeated; until a new build is whole
    the board keeps the former one. Where other modules would be imported instead of the build's, nothing is written
    (unless `remove_shadows`) and the reasons say so.
    Raises InputError for a bad build or a way that the board does not have, PortError where the board does not answer
    or something did not arrive whole.
    """
    built = read_built(folder)
    state = ask(port)
    files, image = for_processor(built, state.processor)
    way = choose(way, state, len(image))
    if way != FROZEN:
        _require_loadable(files, state)
    found = strays(state, way, built)
    if remove_shadows and found.removable:
        say(f"removing {', '.join(found.removable)}")
        mpremote.remove(port, found.removable)
        state = ask(port)
        found = strays(state, way, built)
    reasons = (*_stands_before(found), *_firmware_reasons(built, state, way))
    if reasons:
        return Flashed(port, way, built.build, built.calibration, {}, strays=found, reasons=reasons)
    return _put(port, way, built, state, found, files, image, say)


def _put(
    port: str,
    way: str,
    built: Built,
    state: BoardState,
    found: Strays,
    files: dict[str, bytes],
    image: bytes,
    say: Say,
) -> Flashed:
    copied: tuple[str, ...] = ()
    written = 0
    digests: dict[str, str] = {}
    if way == ROMFS:
        written = write_image(port, image, say)
        digests["romfs"] = sha256(image)
        files = {MAIN: files[MAIN]}
    if way != FROZEN:
        copied = install(port, files, state, say)
        digests |= {target: sha256(data) for target, data in files.items()}
    if way == MPY:
        clear(port, files)
    mpremote.reset(port)
    return Flashed(port, way, built.build, built.calibration, digests, copied, written, found)


def _require_loadable(files: dict[str, bytes], state: BoardState) -> None:
    made = next((mpy.version(data) for target, data in files.items() if target.endswith(".mpy")), state.mpy_version)
    if state.mpy and made != state.mpy_version:
        have = f"version {state.mpy_version} ({state.machine})"
        raise InputError(must("MicroPython on the board", f"one that loads .mpy files of version {made}", have))


def _stands_before(found: Strays) -> tuple[str, ...]:
    if not found.shadows:
        return ()
    what = "are" if len(found.shadows) > 1 else "is"
    how = "--remove-shadows removes it" if found.removable else "--way romfs replaces it"
    return (f"{', '.join(found.shadows)} {what} imported instead of the build's modules: {how}",)


def _firmware_reasons(built: Built, state: BoardState, way: str) -> tuple[str, ...]:
    """Frozen modules come before files and ROMFS, and only another firmware changes them."""
    there = f"build {state.frozen_build}" if state.frozen_build else "none"
    if way != FROZEN:
        wrong = f"the firmware has modules of barberpole in it ({there}), which are imported instead: use --way frozen"
        return (wrong,) if state.frozen_build else ()
    if state.frozen_build == built.build:
        return ()
    return (must("the build in the firmware", built.build, there, state.machine), firmware_advice(built))


def firmware_advice(built: Built) -> str:
    """How to make and install the firmware, in one sentence; barberpole does neither."""
    if not built.firmware:
        return f"there is no board definition for {built.board}: freeze what manifest.py of {built.folder} lists"
    made, variant = built.folder / built.firmware["board_dir"], built.firmware["variant"]
    return (
        f"make MicroPython's stm32 port with BOARD_DIR={made.resolve()} and BOARD_VARIANT={variant}, "
        f"and install it {built.firmware['install']}"
    )


def pull(port: str, target: Path) -> None:
    """The coil run and verdict of the last power-up, from the board's flash."""
    mpremote.require_port(port)
    with arriving(target) as beside:
        mpremote.fetch(port, RUN_FILE, beside)
