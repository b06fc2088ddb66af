"""The board definitions for MicroPython's stm32 port, checked without a compiler: flash map, names, manifest."""

import json
import re
from dataclasses import replace

import pytest
from barberpole import paths
from barberpole.board import load_board
from barberpole_codegen import build, flash_map, ways
from barberpole_codegen.flash_map import FLASH_MAPS, KIB, PREFIX, START, definition, sectors

DEFINITIONS = paths.boards() / "micropython"
STOCK_BYTES = 378844  # text + data of PYBV11, as its linker counted them
FROZEN_BYTES = {22377: 402352, 35027: 414508}  # bytes of .mpy -> the same with them frozen (BARBERPOLE_PYBV11, FROZEN)


@pytest.fixture(params=sorted(FLASH_MAPS))
def found(request):
    return definition(replace(load_board("pybv11"), micropython_board=request.param))


def test_every_folder_is_a_definition_with_a_flash_map():
    assert {path.name.removeprefix(PREFIX) for path in DEFINITIONS.iterdir()} == set(FLASH_MAPS)


def test_a_board_without_a_definition_has_the_first_way_only(tmp_path, calibration, board):
    made = build(replace(board, micropython_board="OTHER"), calibration, tmp_path / "out")
    assert set(made.budget["ways"]) == {"mpy"}
    assert json.loads((tmp_path / "out" / "build.json").read_text())["firmware"] == {}
    assert not (tmp_path / "out" / "micropython").exists()


def test_the_partition_is_made_of_whole_sectors_and_overlaps_nothing(found):
    start, end = found.romfs
    inside = [s for s in sectors(found.map.kib) if s[0] >= start and s[1] <= end]
    assert inside[0][0] == start
    assert inside[-1][1] == end
    assert end <= found.storage[0] or start >= found.storage[1]
    text_start = found.map.text[0]
    assert end <= text_start or start >= text_start + found.map.firmware_bytes
    assert found.text_end - text_start >= found.map.firmware_bytes
    assert end <= START + found.map.kib * KIB


def test_sectors_are_those_of_the_reference_manual():
    assert [(end - start) // KIB for start, end in sectors(1024)] == [16] * 4 + [64] + [128] * 7
    assert sectors(1024)[11] == (0x080E0000, 0x08100000)
    assert [(end - start) // KIB for start, end in sectors(512)] == [16] * 4 + [64] + [128] * 3


def test_a_linker_says_no_where_the_firmware_would_reach_the_partition(found):
    """On the boards where the partition lies behind the firmware."""
    script = (found.folder / "romfs.ld").read_text()
    assert ("ASSERT(" in script) == (found.romfs[0] >= found.map.text[0])


def test_the_definition_extends_the_stock_board(found):
    stock = found.folder.name.removeprefix(PREFIX)
    texts = {path.name: path.read_text() for path in found.folder.iterdir()}
    for name in ("mpconfigboard.h", "stm32f4xx_hal_conf.h"):
        assert f'#include "boards/{stock}/{name}"' in texts[name]
    header, makefile = texts["mpconfigboard.h"], texts["mpconfigboard.mk"]
    assert "#define MICROPY_HW_ROMFS_ENABLE_INTERNAL_FLASH (1)" in header
    assert "#define MICROPY_HW_ROMFS_ENABLE_PART0 (1)" in header
    assert f"include boards/{stock}/mpconfigboard.mk" in makefile
    assert "LD_FILES += $(BOARD_DIR)/romfs.ld" in makefile
    # stm32.mk assigns it after the board's makefile was read, so a plain assignment would be lost
    assert re.search(r"^override MPY_CROSS_MCU_ARCH_f4 = armv7emsp$", makefile, re.MULTILINE)
    assert set(json.loads(texts["board.json"])["variants"]) == {flash_map.FROZEN}
    assert "FROZEN_MANIFEST = $(BOARD_DIR)/manifest.py" in texts["mpconfigvariant_FROZEN.mk"]


def test_the_manifest_of_a_built_definition_freezes_what_was_built(tmp_path, calibration, board):
    made = build(board, calibration, tmp_path / "out")
    described = json.loads((made.folder / "build.json").read_text())
    board_dir = made.folder / described["firmware"]["board_dir"]
    frozen = set()

    def include(path):
        if path.startswith("$(BOARD_DIR)"):
            run(board_dir / path.removeprefix("$(BOARD_DIR)/"))

    def run(path):
        def freeze(folder, names, opt):
            frozen.update((path.parent / folder / name).resolve() for name in names)

        exec(path.read_text(), {"include": include, "freeze": freeze})

    run(board_dir / "manifest.py")
    assert frozen == {path.resolve() for path in (made.folder / "src").iterdir()}
    assert {path.name for path in board_dir.iterdir()} == {path.name for path in definition(board).folder.iterdir()}


def test_room_for_each_way_is_said(tmp_path, calibration, board):
    made = build(board, calibration, tmp_path / "out")
    room = made.budget["ways"]
    assert room["mpy"]["of"] == board.filesystem_kib * KIB
    assert room["romfs"] == {
        "bytes": (made.folder / "romfs.img").stat().st_size,
        "of": 128 * KIB,
        "fits": True,
        "where": "partition at 0x080e0000",
    }
    assert room["frozen"]["of"] == 896 * KIB - FLASH_MAPS["PYBV11"].firmware_bytes
    assert all(way["fits"] for way in room.values())


@pytest.mark.parametrize("mpy_bytes", sorted(FROZEN_BYTES))
def test_the_estimate_of_frozen_code_meets_what_a_linker_counted(mpy_bytes):
    """Native code freezes at its size, bytecode a little above it: the estimate is the larger share."""
    counted = FROZEN_BYTES[mpy_bytes] - STOCK_BYTES
    assert 0.995 * counted < ways.FROZEN_PER_MPY * mpy_bytes < 1.05 * counted


def test_the_build_hash_follows_the_sources():
    sources = {"main.py": "a = 1\n", "bp_x.py": "b = 2\n"}
    assert ways.build_hash(sources) == ways.build_hash(dict(reversed(sources.items())))
    assert ways.build_hash(sources) != ways.build_hash(sources | {"bp_x.py": "b = 3\n"})
    names: dict = {}
    exec(ways.mark(sources, "0123456789ab", "0.1"), names)
    assert (names["BUILD"], names["CALIBRATION"]) == (ways.build_hash(sources), "0123456789ab")
    assert names["MODULES"] == ("bp_x", "main")
