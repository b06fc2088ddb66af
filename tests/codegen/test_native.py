"""Native code in a build: for the Cortex-M4 in the files, for another processor where the board has one."""

import json
from dataclasses import replace

import pytest
from barberpole import mpy
from barberpole.built import for_processor, read_built
from barberpole.errors import InputError
from barberpole_codegen import build

THUMB = "import micropython\n\n\n@micropython.asm_thumb\ndef same(r0):\n    mov(r1, r0)\n"
NATIVE = "lib/bp_fixed.mpy"
X64, CORTEX_M4 = mpy.ARCHITECTURES.index("x64"), mpy.ARCHITECTURES.index(mpy.CORTEX_M4)


@pytest.fixture(scope="module")
def built(board, calibration, tmp_path_factory):
    return read_built(build(board, calibration, tmp_path_factory.mktemp("native") / "out").folder)


def test_native_code_is_for_the_mcu_and_made_anew_for_the_emulated_board(built, micropython, tmp_path):
    assert list(built.texts) == [NATIVE]
    assert mpy.architecture(built.files[NATIVE]) == CORTEX_M4
    same, romfs = for_processor(built, CORTEX_M4)
    assert (same, romfs) == (built.files, built.romfs)
    files, romfs = for_processor(built, X64)
    assert mpy.architecture(files[NATIVE]) == X64
    assert [path for path in files if files[path] != same[path]] == [NATIVE]
    assert files[NATIVE] in romfs
    (tmp_path / "bp_fixed.mpy").write_bytes(files[NATIVE])
    check_value = micropython("import bp_fixed; print(bp_fixed.crc16(b'123456789', 9))", tmp_path)
    assert int(check_value) == 0x29B1  # of CRC-16/CCITT-FALSE


def test_native_code_for_nothing_known_is_refused(built):
    with pytest.raises(InputError, match="runs native code"):
        for_processor(built, 0)
    thumb = replace(built, texts={NATIVE: THUMB})
    with pytest.raises(InputError, match="a module that mpy-cross accepts"):
        for_processor(thumb, X64)


@pytest.mark.parametrize("harm", ["file", "listing", "format"])
def test_a_build_that_was_changed_is_refused(board, calibration, tmp_path, harm):
    folder = build(board, calibration, tmp_path / "out").folder
    listing = folder / "build.json"
    described = json.loads(listing.read_text())
    if harm == "file":
        (folder / "mpy" / "bp_main.mpy").write_bytes(b"M\x06")
    elif harm == "listing":
        listing.write_text("[]")
    else:
        del described["build"]
        listing.write_text(json.dumps(described))
    with pytest.raises(InputError, match=r"as built|as this `barberpole build` writes it"):
        read_built(folder)
