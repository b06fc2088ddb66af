"""Where things lie in a board's flash, and how much room each way to the board has.

The maps are those of MicroPython's linker scripts (ports/stm32/boards/stm32f405.ld, stm32f411.ld, 1.29), the ROMFS
partition is read from the board definition in boards/micropython, the size of the firmware was measured on a build of
that definition (MicroPython 1c3c2011, between 1.28 and 1.29; GCC 12.2).
"""

import re
from dataclasses import dataclass
from pathlib import Path

from barberpole import paths
from barberpole.board import Board

KIB = 1024
START = 0x08000000
PREFIX = "BARBERPOLE_"  # of our board definitions; the stock board's name follows
FROZEN = "FROZEN"  # the variant of a definition that has barberpole in the firmware
_SYMBOL = re.compile(r"^_micropy_hw_(\w+) = (0x[0-9A-Fa-f]+);", re.MULTILINE)


@dataclass(frozen=True)
class FlashMap:
    """Regions of a stock board, addresses as (start, end), and what its firmware takes."""

    kib: int
    storage: tuple[int, int]
    text: tuple[int, int]
    firmware_bytes: int
    """text + data of the firmware with a ROMFS partition, as its linker counts them; interrupt vectors included."""
    install: str
    """How a firmware gets onto the board, for people."""


_DFU = "in the boot loader (machine.bootloader() at the prompt, or pin DFU at 3V3): dfu-util -a 0 -D firmware.dfu"
_STLINK = "through the board's own ST-LINK: st-flash --connect-under-reset --format ihex write firmware.hex"
FLASH_MAPS = {
    "PYBV11": FlashMap(1024, (0x08004000, 0x08020000), (0x08020000, 0x08100000), 381232, _DFU),
    "STM32F4DISC": FlashMap(1024, (0x08004000, 0x08020000), (0x08020000, 0x08100000), 340280, _STLINK),
    "NUCLEO_F446RE": FlashMap(512, (0x08004000, 0x08014000), (0x08020000, 0x08080000), 321444, _STLINK),
}


@dataclass(frozen=True)
class Definition:
    """A board definition of ours: its folder, and what it changes in the flash."""

    folder: Path
    map: FlashMap
    storage: tuple[int, int]
    romfs: tuple[int, int]

    @property
    def text_end(self) -> int:
        """End of the firmware beside the ROMFS partition."""
        start, end = self.map.text
        return min(end, self.romfs[0]) if self.romfs[0] >= start else end


def definition(board: Board) -> Definition | None:
    """The board definition for a board, None where there is none for its `micropython_board`."""
    name = board.micropython_board
    folder = paths.boards() / "micropython" / (PREFIX + name)
    if name not in FLASH_MAPS or not folder.is_dir():
        return None
    values = {key: int(value, 16) for key, value in _SYMBOL.findall((folder / "romfs.ld").read_text())}
    flash, start = FLASH_MAPS[name], values["romfs_part0_start"]
    end = values.get("internal_flash_storage_end", flash.storage[1])
    return Definition(folder, flash, (flash.storage[0], end), (start, start + values["romfs_part0_size"]))


def sectors(kib: int) -> list[tuple[int, int]]:
    """(start, end) of the sectors of an STM32F405, 407 or 446: 4 of 16 KiB, one of 64, then 128 (RM0090 table 5)."""
    sizes = [16 * KIB] * 4 + [64 * KIB]
    sizes += [128 * KIB] * ((kib * KIB - sum(sizes)) // (128 * KIB))
    starts = [START + sum(sizes[:i]) for i in range(len(sizes))]
    return [(start, start + size) for start, size in zip(starts, sizes, strict=True)]
