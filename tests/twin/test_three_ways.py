"""One build, three ways to the board: the same firmware runs, and what is in its way is found and said."""

import json
import subprocess
import sys
import time
from dataclasses import replace

import pytest
from barberpole.board import load_board
from barberpole.built import read_built, sha256
from barberpole.errors import InputError, PortError
from barberpole.link import installing, mpremote, romfs
from barberpole.link.deploy import flash
from barberpole.nominal import nominal
from barberpole.records import HEADER, RESULT, decode
from barberpole.twin import Twin
from barberpole_codegen import build

ROMFS_KIB = 128
PATIENCE_S = 30.0
CHANGED = 12
GAIN_NOISE = 3e-5  # three times the standard error of a gain from one coil run


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A build, and one with another calibration (every module of it but one is the same)."""
    board = load_board("pybv11")
    calibration = nominal(board)
    scale = calibration.parameters["scale.x"]
    other = replace(
        calibration, parameters={**calibration.parameters, "scale.x": replace(scale, value=1.01 * scale.value)}
    )
    folder = tmp_path_factory.mktemp("builds")
    return build(board, calibration, folder / "first"), build(board, other, folder / "second")


@pytest.fixture
def started(tmp_path):
    """started(**firmware): an empty board."""
    twins = []

    def begin(**firmware):
        twin = Twin(load_board("pybv11"), tmp_path / f"flash{len(twins)}", seed=3, **firmware)
        twins.append(twin)
        return twin.__enter__()

    yield begin
    for twin in twins:
        twin.close()


def power_up(twin):
    """Header and verdict of one power-up, None for both where the board fell through to its prompt."""
    said = twin.said()
    twin.power_cycle(seed=3)
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        frames = decode(twin.said_since(said).encode()).frames
        if any(frame.type == RESULT for frame in frames):
            head, result = (next(f.json for f in frames if f.type == kind) for kind in (HEADER, RESULT))
            return head, result
        if ">>> " in twin.said_since(said):
            return None, None
        time.sleep(0.02)
    raise AssertionError(twin.said_since(said)[-2000:])


def test_all_three_ways_run_the_same_firmware(built, started):
    first = built[0]
    results = {}
    for way, firmware in {"mpy": {}, "romfs": {"romfs_kib": ROMFS_KIB}, "frozen": {"frozen": first.folder}}.items():
        twin = started(**firmware)
        done = flash(first.folder, twin.port)
        assert (done.way, done.passed, done.build) == (way, True, first.build)
        head, result = power_up(twin)
        assert head["calibration"] == first.calibration
        assert result["accepted"], result
        results[way] = result["gain"]
        places = mpremote.run(twin.port, "exec", "import bp_main, bp_trajectory; print(bp_main.__file__)")
        assert {"mpy": "/lib/bp", "romfs": "/rom/lib/bp", "frozen": "/.frozen/lib/bp"}[way] in places
    for way in ("romfs", "frozen"):  # a file system that was used otherwise shifts the samples in time
        assert results[way] == pytest.approx(results["mpy"], abs=GAIN_NOISE)
    assert all(0.8 < gain < 1.2 for gain in results["mpy"])


def test_a_second_flash_copies_what_differs(built, started):
    first, second = built
    twin = started()
    assert len(flash(first.folder, twin.port).copied) == len(first.files)
    assert flash(first.folder, twin.port).copied == ()
    assert set(flash(second.folder, twin.port).copied) == {"lib/bp_build.mpy", "lib/bp_calibration.mpy"}
    stray = "import os; open('lib/bp_of_a_former_build.mpy', 'w').close(); open('lib/mine.py', 'w').close()"
    mpremote.run(twin.port, "exec", stray)
    assert flash(first.folder, twin.port, way="mpy").passed
    listed = mpremote.run(twin.port, "exec", "import os; print(os.listdir('lib'))")
    assert "bp_of_a_former_build" not in listed
    assert "mine.py" in listed


def test_the_plug_pulled_while_copying_leaves_the_former_build_and_the_rest_is_copied_later(
    built, started, monkeypatch
):
    first, second = built
    twin = started()
    flash(first.folder, twin.port)
    copy = mpremote.copy

    def cut(port, pairs, before=""):
        copy(port, pairs[:7], before)
        twin.kill()
        raise PortError("the cable is out")

    monkeypatch.setattr(installing.mpremote, "copy", cut)
    monkeypatch.setattr("barberpole.link.deploy.read_built", lambda _: changed(second))
    with pytest.raises(PortError):
        flash(second.folder, twin.port)
    monkeypatch.setattr(installing.mpremote, "copy", copy)
    assert power_up(twin)[0]["calibration"] == first.calibration  # whole, as if nothing had been
    done = flash(second.folder, twin.port)
    assert len(done.copied) == CHANGED - 7
    assert power_up(twin)[0]["calibration"] == second.calibration


def changed(built):
    """The build as if another dozen of its files were new, the main program among them."""
    read = read_built(built.folder)
    native_first = sorted(read.files, key=lambda path: path not in read.texts)
    paths = [*native_first[: CHANGED - 1], "main.py"]
    longer = {path: read.files[path] + (b"\n# new\n" if path == "main.py" else b"\0") for path in paths}
    texts = {path: text + "\nNEW = 1\n" for path, text in read.texts.items()}
    return replace(read, files=read.files | longer, texts=texts)


def test_without_room_for_both_an_interrupted_board_does_nothing(built, started, monkeypatch):
    first, second = built
    twin = started()
    flash(first.folder, twin.port)
    monkeypatch.setattr(installing, "SPARE_BYTES", 1 << 20)
    monkeypatch.setattr("barberpole.link.deploy.read_built", lambda _: changed(second))
    copy = mpremote.copy

    def cut(port, pairs, before=""):
        copy(port, pairs[:7], before)
        raise PortError("the cable is out")

    monkeypatch.setattr(installing.mpremote, "copy", cut)
    with pytest.raises(PortError):
        flash(second.folder, twin.port)
    assert power_up(twin) == (None, None)
    assert "barberpole is not complete" in twin.log_text
    monkeypatch.setattr(installing.mpremote, "copy", copy)
    assert len(flash(second.folder, twin.port).copied) == CHANGED - 7 + 1  # and bp_main, taken away meanwhile
    assert power_up(twin)[0]["calibration"] == second.calibration


@pytest.mark.parametrize("moved", [0, 9])
def test_the_plug_pulled_while_moving_is_mended_by_the_board(built, started, monkeypatch, moved):
    first, second = built
    twin = started()
    flash(first.folder, twin.port)
    halfway = installing._MOVE.replace("for name in {names!r}:", f"for name in {{names!r}}[:{moved}]:")
    halfway = halfway[: halfway.index("os.remove")]

    monkeypatch.setattr(installing, "_MOVE", halfway + "raise OSError('the plug is pulled')\n")
    monkeypatch.setattr("barberpole.link.deploy.read_built", lambda _: changed(second))
    with pytest.raises(PortError, match="the plug is pulled"):
        flash(second.folder, twin.port)
    assert power_up(twin)[0]["calibration"] == second.calibration
    assert "bp.new" not in mpremote.run(twin.port, "exec", "import os; print(os.listdir('lib'))")


def test_a_romfs_image_cut_short_is_never_mounted_and_is_completed(built, started, monkeypatch):
    first, second = built
    twin = started(romfs_kib=ROMFS_KIB)
    assert flash(first.folder, twin.port).romfs_bytes_written >= len(read_built(first.folder).romfs)
    assert flash(first.folder, twin.port).romfs_bytes_written == 0
    run = romfs._run

    def cut(port, steps):
        run(port, steps[:4])  # begin, erase, two chunks
        twin.kill()
        raise PortError("the cable is out")

    monkeypatch.setattr(romfs, "_run", cut)
    with pytest.raises(PortError):
        flash(second.folder, twin.port)
    monkeypatch.setattr(romfs, "_run", run)
    assert power_up(twin) == (None, None)
    assert "barberpole is not complete" in twin.log_text
    said = []
    done = flash(second.folder, twin.port, said.append)
    size = len(read_built(second.folder).romfs)
    assert size - 2 * romfs.CHUNK_BYTES <= done.romfs_bytes_written < size - romfs.CHUNK_BYTES
    assert power_up(twin)[0]["calibration"] == second.calibration


def test_what_shadows_rom_is_said_and_removed_when_asked(built, started):
    first = built[0]
    twin = started(romfs_kib=ROMFS_KIB)
    plant = "import os; open('/bp_flip.py', 'w').close(); os.mkdir('/lib'); open('/lib/bp_main.py', 'w').close()"
    mpremote.run(twin.port, "exec", plant)
    done = flash(first.folder, twin.port)
    assert not done.passed
    assert done.strays.shadows == ("/bp_flip.py",)
    assert done.strays.idle == ("/lib/bp_main.py",)
    assert "/bp_flip.py is imported instead" in done.reasons[0]
    assert romfs._hashes(twin.port, 512)[0] == sha256(b"\xff" * 512)  # nothing was written
    command = [sys.executable, "-m", "barberpole", "flash", str(first.folder), "--port", twin.port, "--json"]
    said = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    answer = json.loads(said.stdout)
    assert said.returncode == 1
    assert (answer["pass"], answer["way"], answer["shadows"]) == (False, "romfs", ["/bp_flip.py"])
    done = flash(first.folder, twin.port, remove_shadows=True)
    assert done.passed
    assert done.strays.idle == ()


def test_text_beside_compiled_modules_is_a_shadow(built, started):
    twin = started()
    flash(built[0].folder, twin.port)
    mpremote.run(twin.port, "exec", "open('/lib/bp_flip.py', 'w').close()")
    assert flash(built[0].folder, twin.port).strays.shadows == ("/lib/bp_flip.py",)
    assert flash(built[0].folder, twin.port, remove_shadows=True).passed


def test_another_frozen_build_cannot_be_helped_by_files(built, started):
    first, second = built
    twin = started(frozen=first.folder)
    done = flash(second.folder, twin.port)
    assert (done.way, done.passed) == ("frozen", False)
    assert first.build in done.reasons[0]
    assert second.build in done.reasons[0]
    assert "BOARD_DIR=" in done.reasons[1]
    assert "dfu-util" in done.reasons[1]
    assert "use --way frozen" in flash(second.folder, twin.port, way="mpy").reasons[0]
    mpremote.run(twin.port, "exec", "open('/bp_main.py', 'w').close()")
    assert flash(first.folder, twin.port).strays.shadows == ("/bp_main.py",)


def test_a_way_that_the_board_lacks_is_refused(built, started):
    twin = started()
    with pytest.raises(InputError, match="ROMFS partition must be at least"):
        flash(built[0].folder, twin.port, way="romfs")
    done = flash(built[0].folder, twin.port, way="frozen")
    assert not done.passed
    assert "got none" in done.reasons[0]
