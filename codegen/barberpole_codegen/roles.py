"""The folder of a build for a role other than that of a sensor board: of one form, so that `flash` takes all."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from barberpole import mpy
from barberpole.board import Board
from barberpole.built import LISTING, MAIN, romfs_image, sha256
from barberpole.driver_board import Driver

from barberpole_codegen import budget, image, ways
from barberpole_codegen.folder import as_json, write_folder
from barberpole_codegen.modules import VERSION

FORMAT = 2


@dataclass(frozen=True)
class Head:
    """What a listing says of a build; model and calibration are empty where the role has none."""

    role: str
    board: str
    model: str
    calibration: str
    trajectory: str


@dataclass(frozen=True)
class Compiled:
    """The modules as text and compiled, and the ROMFS image of the latter."""

    sources: Mapping[str, str]
    compiled: Mapping[str, bytes]
    rom: bytes


@dataclass(frozen=True)
class RoleBuild:
    """What was built. `files`: path in the folder -> path on the board, relative to its working folder."""

    folder: Path
    build: str
    board: str
    calibration: str
    trajectory: str
    files: dict[str, str]
    budget: dict[str, Any]


def write_role(
    out_dir: Path,
    head: Head,
    texts: Mapping[str, str],
    costs_of: Callable[[Compiled], dict[str, Any]],
    say: Callable[[str], None],
) -> RoleBuild:
    """Compile the sources `texts` by file name, and write the whole folder. Raises InputError or LimitError."""
    build_hash = ways.build_hash(texts)
    sources = {**texts, f"{ways.MARK}.py": ways.mark(texts, head.calibration, VERSION)}
    say(f"compiling {len(sources) - 1} modules")
    names = sorted(name for name in sources if name != MAIN)
    compiled = {name.replace(".py", ".mpy"): mpy.compile_module(name, sources[name]) for name in names}
    made = Compiled(sources, compiled, romfs_image(compiled))
    costs = costs_of(made)
    files = {f"mpy/{name}": f"lib/{name}" for name in compiled} | {f"src/{MAIN}": MAIN}
    content = {f"src/{name}": text.encode() for name, text in sources.items()}
    content |= {f"mpy/{name}": data for name, data in compiled.items()}
    listed = image.manifest(list(sources)).encode()
    content |= {"romfs.img": made.rom, "manifest.py": listed, "budget.json": as_json(costs)}
    done = RoleBuild(out_dir, build_hash, head.board, head.calibration, head.trajectory, files, costs)
    content[LISTING] = as_json(_describe(done, head, content))
    write_folder(out_dir, content)
    say(f"built {out_dir}")
    return done


def room(board: Board | Driver, made: Compiled) -> dict[str, Any]:
    """Bytes of flash, for budget.json. Raises LimitError where the files exceed the board's file system."""
    flash = budget.flash_bytes({**made.compiled, MAIN: made.sources[MAIN].encode()})
    sizes = {name: size for name, size in flash.items() if name != "total"}
    ways_of = ways.figures(board, sizes, len(made.rom), None)
    return {"ways": ways_of, "flash_bytes": flash, "romfs_bytes": len(made.rom)}


def _describe(made: RoleBuild, head: Head, content: Mapping[str, bytes]) -> dict[str, Any]:
    def entry(source: str, **more: str) -> dict[str, Any]:
        data = content[source]
        found = {"source": source, **more, "bytes": len(data), "sha256": sha256(data)}
        if source.endswith(".mpy") and mpy.architecture(data):  # native code; for another processor made anew
            found["text"] = source.replace("mpy/", "src/").replace(".mpy", ".py")
        return found

    return {
        "format": FORMAT,
        "generator": f"barberpole_codegen {VERSION}",
        "build": made.build,
        "board": head.board,
        "role": head.role,
        "model": head.model,
        "calibration": head.calibration,
        "trajectory": head.trajectory,
        "files": [entry(source, target=target) for source, target in sorted(made.files.items())],
        "romfs": entry("romfs.img"),
        "firmware": {},
    }
