"""The folder that a board needs: whole, reproducible, and honest about its cost."""

import json
import shutil
from dataclasses import replace

import pytest
from barberpole import mpy
from barberpole.built import romfs_image
from barberpole.errors import InputError, LimitError
from barberpole_codegen import build, image
from barberpole_codegen.budget import ram_on_import, times_us


@pytest.fixture(scope="module")
def built(board, calibration, tmp_path_factory):
    said: list[str] = []
    result = build(board, calibration, tmp_path_factory.mktemp("build") / "out", said.append)
    assert said
    return result


def contents(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_every_file_is_listed_with_its_place(built):
    listing = json.loads((built.folder / "build.json").read_text())
    targets = {entry["target"] for entry in listing["files"]}
    modules = {path.stem for path in (built.folder / "src").glob("bp_*.py")}
    assert targets == {"main.py"} | {f"lib/{name}.mpy" for name in modules}
    assert [entry["target"] for entry in listing["files"] if "text" in entry] == ["lib/bp_fixed.mpy"]  # native code
    assert listing["calibration"] == built.calibration
    for entry in listing["files"]:
        assert (built.folder / entry["source"]).stat().st_size == entry["bytes"]


def test_build_is_reproducible_and_replaces_a_former_one(built, board, calibration, tmp_path):
    again = build(board, calibration, tmp_path / "other")
    assert contents(again.folder) == contents(built.folder)
    (again.folder / "stale").write_text("x")
    build(board, calibration, again.folder)
    assert contents(again.folder) == contents(built.folder)
    assert [p.name for p in tmp_path.iterdir()] == ["other"]


def test_a_folder_with_something_else_is_left_alone(board, calibration, tmp_path):
    (tmp_path / "mine.txt").write_text("x")
    with pytest.raises(InputError, match="new or empty folder"):
        build(board, calibration, tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["mine.txt"]


def test_nothing_half_written_on_error(board, calibration, tmp_path):
    small = replace(board, filesystem_kib=8)
    with pytest.raises(LimitError, match=r"at most 8 KiB"):
        build(small, calibration, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("table", "change", "says"),
    [
        ("adc", {"pga": 3}, "a power of two"),
        ("adc", {"sample_hz": 7000.0}, "a rate of the ads131m08"),
        ("adc", {"baud": 1000000}, "at least 1.92e"),
        ("selfcal", {"cycles_per_point": 32}, "at most 255"),
    ],
)
def test_what_the_parts_cannot_do_is_refused(board, calibration, tmp_path, table, change, says):
    asked = replace(board, **{table: replace(getattr(board, table), **change)})
    with pytest.raises(LimitError, match=says):
        build(asked, calibration, tmp_path / "out")
    assert not list(tmp_path.iterdir())


def test_a_limit_without_bound_is_refused(board, calibration, tmp_path):
    """A residual edited to infinity would be a limit that no run exceeds, and no number in MicroPython."""
    residual = replace(calibration.residual, rms_lsb=float("inf"))
    with pytest.raises(InputError, match="inf"):
        build(board, replace(calibration, residual=residual), tmp_path / "out")


def test_a_model_that_cannot_be_undone_is_refused(board, calibration, tmp_path):
    steep = {
        name: replace(value, value=6e-3) if name.startswith("cross_field") else value
        for name, value in calibration.parameters.items()
    }
    with pytest.raises(LimitError, match="a model that can be undone"):
        build(board, replace(calibration, parameters=steep), tmp_path / "out")


def test_mpy_is_for_the_cortex_m4_and_runs_here_too(built, micropython):
    """No native code in it, so the same file runs on the unix interpreter."""
    head = (built.folder / "mpy" / "bp_calibration.mpy").read_bytes()[:2]
    assert head == b"M\x06"
    script = "import bp_calibration, bp_selfcal, bp_store; print(bp_calibration.CALIBRATION)"
    assert micropython(script, built.folder / "mpy").strip() == built.calibration


def test_romfs_image_holds_the_modules(built, micropython):
    script = """
import sys, vfs
with open("romfs.img", "rb") as file:
    vfs.mount(vfs.VfsRom(memoryview(file.read())), "/rom")
sys.path[:] = ["/rom/lib"]
import bp_trajectory
print(bp_trajectory.ID, len(bp_trajectory.CODES))
"""
    name, size = micropython(script, built.folder).split()
    assert name == built.trajectory
    assert int(size) % 6 == 0


def test_a_manifest_freezes_every_module(built):
    frozen = {}
    names = {"include": lambda path: None, "freeze": lambda path, files, opt: frozen.update({path: files})}
    exec((built.folder / "manifest.py").read_text(), names)
    assert set(frozen["src"]) == {p.name for p in (built.folder / "src").glob("*.py")}


def test_a_table_of_12_kb_costs_under_200_bytes_of_heap():
    """In ROMFS the bytes stay where they are. Against the same module without the table; several, as blocks round."""
    table = "CODES = b'" + r"\xa5" * 12288 + "'\n"
    modules = {f"{kind}{i}": text for i in range(5) for kind, text in (("with", table), ("bare", "CODES = 1\n"))}
    compiled = {f"{name}.mpy": mpy.compile_module(f"{name}.py", text) for name, text in modules.items()}
    used = ram_on_import(romfs_image(compiled), sorted(modules))
    assert used is not None
    cost = sorted(used[f"with{i}"] for i in range(5))[2] - sorted(used[f"bare{i}"] for i in range(5))[2]
    assert 0 <= cost < 200


def test_budget_states_cost_and_sources(built, board, generated):
    budget = json.loads((built.folder / "budget.json").read_text())
    assert budget["flash_bytes"]["total"] == sum(v for k, v in budget["flash_bytes"].items() if k != "total")
    assert budget["ram_on_import_bytes"]["bp_trajectory"] < 2048
    assert set(budget["time_us"]["sources"]) >= {"float operation", "operation in viper", "clock"}
    assert budget["time_us"]["selfcal_run"] < 2e6
    assert budget["float32_error_of_full_scale"]["undo"] < 1e-5
    half = times_us(generated.programs, replace(board, cpu_mhz=84.0), generated.hot, generated.path)
    assert half["selfcal_point"] == pytest.approx(2 * budget["time_us"]["selfcal_point"], abs=2)


def test_the_compilers_complaint_is_passed_on():
    with pytest.raises(InputError, match=r"bad.py must be a module that mpy-cross accepts; got .*Error"):
        mpy.compile_module("bad.py", "def f(:\n")


def test_firmware_folder_must_hold_firmware(tmp_path):
    with pytest.raises(InputError, match="firmware folder"):
        image.firmware_sources(tmp_path)


def test_a_kill_between_the_renames_leaves_a_build(built, board, calibration, tmp_path, monkeypatch):
    """If the new folder cannot take its place, the former build is put back."""
    folder = tmp_path / "out"
    shutil.copytree(built.folder, folder)
    moves = []
    rename = type(folder).rename

    def failing(self, target):
        moves.append(self.name)
        if ".tmp-" in self.name:
            raise OSError(28, "No space left on device")
        return rename(self, target)

    monkeypatch.setattr(type(folder), "rename", failing)
    with pytest.raises(InputError, match="No space left"):
        build(board, calibration, folder)
    monkeypatch.undo()
    assert contents(folder) == contents(built.folder)
    assert [p.name for p in tmp_path.iterdir()] == ["out"]
