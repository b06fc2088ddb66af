"""`barberpole build`: one folder with all that a board needs, whole or not at all.

src/*.py        firmware and generated modules as text
mpy/*.mpy       compiled for the board
romfs.img       the same as a ROMFS image
manifest.py     the same for freezing
micropython/    board definition for MicroPython's stm32 port: with a ROMFS partition, or (FROZEN) with the above frozen
budget.json     flash, RAM and time
build.json      hashes, and which file goes where on the board
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from barberpole import mpy, paths
from barberpole.board import Board, load_board
from barberpole.built import LISTING, MAIN, romfs_image, sha256
from barberpole.calibration import Calibration, read_calibration

from barberpole_codegen import budget, image, ways
from barberpole_codegen.flash_map import Definition, definition
from barberpole_codegen.folder import as_json, require_replaceable, write_folder
from barberpole_codegen.modules import VERSION, Generated, generate
from barberpole_codegen.narrow import Precision
from barberpole_codegen.rows import AUTO

FORMAT = 2

Progress = Callable[[str], None]


@dataclass(frozen=True)
class BuildResult:
    """What was built. `files`: path in the folder -> path on the board, relative to its working folder."""

    folder: Path
    build: str
    board: str
    model: str
    calibration: str
    trajectory: str
    files: dict[str, str]
    precision: dict[str, Precision]
    budget: dict[str, Any]


def build(
    board: str | Path | Board,
    calibration: str | Path | Calibration,
    out_dir: str | Path,
    progress: Progress | None = None,
    path: str = AUTO,
) -> BuildResult:
    """Build for a board (name, path or object) with a calibration (path or object) into `out_dir`.

    `path`: how a streamed row is made, "bytecode", "viper" or "auto" (by flip rate).
    `out_dir` is new, empty, or a former build, which is replaced. Raises InputError or LimitError; then nothing
    changed.
    """
    say = progress or (lambda _: None)
    board = board if isinstance(board, Board) else load_board(board)
    calibration = calibration if isinstance(calibration, Calibration) else read_calibration(calibration)
    out_dir = Path(out_dir)
    require_replaceable(out_dir)
    say("tracing the compensation and checking it in float32")
    made = generate(board, calibration, path)
    sources = {**image.firmware_sources(paths.firmware()), **made.texts}
    build_hash = ways.build_hash(sources)
    sources[f"{ways.MARK}.py"] = ways.mark(sources, calibration.hash, VERSION)
    say(f"compiling {len(sources) - 1} modules")
    compiled = _compile(sources)
    say("packing the image and measuring its cost")
    rom, found = romfs_image(compiled), definition(board)
    costs = _costs(board, made, sources, compiled, rom, found)
    files = {f"mpy/{name}": f"lib/{name}" for name in compiled} | {f"src/{MAIN}": MAIN}
    head = (out_dir, build_hash, board.name, calibration.model.hash, calibration.hash, made.table.id)
    result = BuildResult(*head, files, made.precision, costs)
    content = _content(sources, compiled, rom, costs) | ways.definition_files(found)
    content[LISTING] = as_json(_describe(result, content, ways.firmware(found)))
    write_folder(out_dir, content)
    say(f"built {out_dir}")
    return result


def _compile(sources: dict[str, str]) -> dict[str, bytes]:
    modules = sorted(name for name in sources if name != MAIN)
    return {name.replace(".py", ".mpy"): mpy.compile_module(name, sources[name]) for name in modules}


def _costs(
    board: Board,
    made: Generated,
    sources: dict[str, str],
    compiled: dict[str, bytes],
    rom: bytes,
    found: Definition | None,
) -> dict[str, Any]:
    """budget.json. Raises LimitError where the files exceed the board's file system."""
    flash = budget.flash_bytes({**compiled, MAIN: sources[MAIN].encode()})
    sizes = {name: size for name, size in flash.items() if name != "total"}
    return {
        "ways": ways.figures(board, sizes, len(rom), found),
        "flash_bytes": flash,
        "romfs_bytes": len(rom),
        "ram_on_import_bytes": budget.ram_on_import(rom, [name[:-3] for name in made.texts]),
        "ram_source": "gc.mem_free around each import from ROMFS, 64-bit unix interpreter; a board needs about half",
        "points_bytes": 54 * made.table.points,
        "time_us": budget.times_us(made.programs, board, made.hot, made.path),
        "fixed_point": _fixed_point(made),
        "float_operations": {name: sum(p.count().values()) for name, p in made.programs.items()},
        "float32_error_of_full_scale": {name: p.fraction for name, p in made.precision.items()},
    }


def _fixed_point(made: Generated) -> dict[str, Any] | None:
    """What is proven of the row in fixed point, None where no useful range can be."""
    if made.hot is None:
        return None
    hot = made.hot
    return {"range_ut": hot.range_ut, "error_nt": 1e3 * hot.error_ut, "instructions": hot.count()}


def _content(
    sources: dict[str, str], compiled: dict[str, bytes], rom: bytes, costs: dict[str, Any]
) -> dict[str, bytes]:
    content = {f"src/{name}": text.encode() for name, text in sources.items()}
    content |= {f"mpy/{name}": data for name, data in compiled.items()}
    listed = image.manifest(list(sources)).encode()
    content |= {"romfs.img": rom, "manifest.py": listed, "budget.json": as_json(costs)}
    return content


def _describe(result: BuildResult, content: dict[str, bytes], firmware: dict[str, str]) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "generator": f"barberpole_codegen {VERSION}",
        "build": result.build,
        "board": result.board,
        "model": result.model,
        "calibration": result.calibration,
        "trajectory": result.trajectory,
        "files": [_entry(source, target, content[source]) for source, target in sorted(result.files.items())],
        "romfs": {"source": "romfs.img", "bytes": len(content["romfs.img"]), "sha256": sha256(content["romfs.img"])},
        "firmware": firmware,
    }


def _entry(source: str, target: str, data: bytes) -> dict[str, Any]:
    """A file of the board. Native code is for one processor; for any other it is made anew from its text."""
    entry = {"source": source, "target": target, "bytes": len(data), "sha256": sha256(data)}
    if source.endswith(".mpy") and mpy.architecture(data):
        entry["text"] = source.replace("mpy/", "src/").replace(".mpy", ".py")
    return entry
