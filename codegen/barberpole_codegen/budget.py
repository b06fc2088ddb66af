"""What a build costs a board: flash, RAM on import, time.

Flash is counted. RAM is measured, on the real interpreter, by importing each module from the ROMFS image; it runs with
64-bit words there, so a board needs about half. Times are counted operations times a measured cost of each; the
source stands beside every figure. Nothing here was timed on silicon.
"""

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from barberpole.board import Board

from barberpole_codegen.costs import (
    AXIS,
    CALL,
    FLOAT_OPERATION,
    GIVENS_INNER,
    PACK,
    REFERENCE_MHZ,
    RING,
    ROOT,
    VIPER_OPERATION,
    WORD,
    at_clock,
    program_us,
)
from barberpole_codegen.hot import Hot
from barberpole_codegen.rows import RowPath, free_us, row_us
from barberpole_codegen.trace import Program

UNKNOWNS, SIDES = 4, 3
LOOKS = 3  # at the first block of points before the whole run, as in firmware/bp_selfcal.py


def flash_bytes(files: dict[str, bytes]) -> dict[str, int]:
    """Bytes of each file and their sum."""
    sizes = {name: len(content) for name, content in sorted(files.items())}
    return {**sizes, "total": sum(sizes.values())}


def times_us(programs: dict[str, Program], board: Board, hot: Hot | None, path: RowPath) -> dict[str, Any]:
    """Estimated µs of a streamed row and of a self-calibration point, with their parts."""
    inner = UNKNOWNS * (UNKNOWNS - 1) // 2 + UNKNOWNS * SIDES
    rows = row_us(programs, hot, board)
    parts = {
        "undo_coil": program_us(programs["undo_coil"], board),
        "givens_row": at_clock(board, inner * GIVENS_INNER.us),
    }
    cycle_us = 1e6 / board.flip.rate_hz
    point_us = parts["undo_coil"] + parts["givens_row"]
    run = board.selfcal
    cycles = run.settle_cycles + run.cycles_per_point
    read = run.points + LOOKS * 6 * len(run.radii_ut)
    return {
        "path": path.name,
        "path_why": path.why,
        "parts": {name: round(value) for name, value in (rows[path.name] | parts).items()},
        "row_by_path": {name: round(sum(found.values())) for name, found in rows.items()},
        "flip_cycle": round(cycle_us),
        "free_for_a_row": round(free_us(board)),
        "sample": round(sum(rows[path.name].values())),
        "selfcal_point": round(point_us),
        "selfcal_run": round(run.points * cycles * cycle_us + read * point_us),
        "meaning": _MEANING,
        "sources": _sources(board),
    }


def ram_on_import(image: bytes, names: list[str]) -> dict[str, int] | None:
    """Heap bytes that importing each module takes from the ROMFS image, None where no interpreter is installed."""
    interpreter = find_micropython()
    if interpreter is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "image").write_bytes(image)
        script = Path(folder, "measure.py")
        script.write_text(_MEASURE % {"image": str(Path(folder, "image")), "names": tuple(names)})
        done = subprocess.run([interpreter, str(script)], capture_output=True, text=True, timeout=60, check=False)
    return json.loads(done.stdout) if done.returncode == 0 else None


def find_micropython() -> str | None:
    """The unix interpreter of this environment, or on the path."""
    beside = Path(sys.executable).with_name("micropython")
    return str(beside) if beside.exists() else shutil.which("micropython")


_MEASURE = """\
import gc, json, sys, vfs
with open(%(image)r, "rb") as file:
    image = file.read()
vfs.mount(vfs.VfsRom(memoryview(image)), "/rom")
sys.path[:] = ["/rom/lib"]
used = {}
for name in %(names)r:
    gc.collect()
    before = gc.mem_free()
    __import__(name)
    gc.collect()
    used[name] = before - gc.mem_free()
print(json.dumps(used))
"""


_MEANING = {
    "sample": "counted operations of one streamed row times the cost of each, not timed; what does not fit beside "
    "sampling stretches the flip cycle",
    "selfcal_point": "arithmetic of one point, done after the coils are off",
    "selfcal_run": "flip cycles of all points, three looks at the first block, arithmetic of all points",
}


def _sources(board: Board) -> dict[str, str]:
    costs = {
        "float operation": FLOAT_OPERATION,
        "square root": ROOT,
        "inner step of a Givens row": GIVENS_INNER,
        "sum of an axis": AXIS,
        "ring": RING,
        "sample in bytecode": WORD,
        "operation in viper": VIPER_OPERATION,
        "call of native code": CALL,
        "figure of a row in bytecode": PACK,
    }
    said = {name: f"{cost.us:g} us: {cost.source}" for name, cost in costs.items()}
    return {**said, "clock": f"figures at {REFERENCE_MHZ:g} MHz, scaled to {board.cpu_mhz:g} MHz"}
