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
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from barberpole.board import Board

from barberpole_codegen.trace import SQRT, Program

REFERENCE_MHZ = 168.0


@dataclass(frozen=True)
class Cost:
    """µs of one operation of bytecode at 168 MHz, and where the figure comes from."""

    us: float
    source: str


# Timed on the stm32 port for the F405, run in an emulator that counts cycles: about 20 % either way.
FLOAT_OPERATION = Cost(9.4, "340 us for demodulation, 3 x 3 matrix and cross field: 36 float operations")
GIVENS_INNER = Cost(
    55.0, "4.1 ms for a row of 10 unknowns and 3 right-hand sides: 75 inner steps, square roots included"
)
SAMPLE_WORD = Cost(4.6, "220 us for the sum of 16 x 3 samples; a three-byte word is counted as two")
FRAME_BYTE = Cost(8.0, "estimated: 12 bytecodes a byte for the check sum, as in the sum of samples")
ROOT = Cost(12.0, "estimated: a float operation and a call")

UNKNOWNS, SIDES = 4, 3
LOOKS = 3  # at the first block of points before the whole run, as in firmware/bp_selfcal.py
ROW_BYTES = 69  # of a streamed frame before base64


def flash_bytes(files: dict[str, bytes]) -> dict[str, int]:
    """Bytes of each file and their sum."""
    sizes = {name: len(content) for name, content in sorted(files.items())}
    return {**sizes, "total": sum(sizes.values())}


def program_us(program: Program, board: Board) -> float:
    """Estimated time of one call."""
    count = program.count()
    roots = count.get(SQRT, 0)
    return _at(board, (sum(count.values()) - roots) * FLOAT_OPERATION.us + roots * ROOT.us)


def times_us(programs: dict[str, Program], board: Board) -> dict[str, Any]:
    """Estimated µs of a streamed row and of a self-calibration point, with their parts."""
    inner = UNKNOWNS * (UNKNOWNS - 1) // 2 + UNKNOWNS * SIDES
    words = 2 * 3 * board.adc.samples_per_half
    parts = {
        "sums_of_a_cycle": _at(board, 2 * words * SAMPLE_WORD.us),
        "undo": program_us(programs["undo"], board),
        "undo_coil": program_us(programs["undo_coil"], board),
        "givens_row": _at(board, inner * GIVENS_INNER.us),
        "frame": _at(board, ROW_BYTES * FRAME_BYTE.us),
    }
    cycle_us = 1e6 / board.flip.rate_hz
    point_us = parts["undo_coil"] + parts["givens_row"]
    run = board.selfcal
    cycles = run.settle_cycles + run.cycles_per_point
    read = run.points + LOOKS * 6 * len(run.radii_ut)
    return {
        "parts": {name: round(value) for name, value in parts.items()},
        "flip_cycle": round(cycle_us),
        "sample": round(parts["sums_of_a_cycle"] + parts["undo"] + parts["frame"]),
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
    "sample": "arithmetic of one streamed row; what does not fit beside sampling stretches the flip cycle",
    "selfcal_point": "arithmetic of one point, done after the coils are off",
    "selfcal_run": "flip cycles of all points, three looks at the first block, arithmetic of all points",
}


def _sources(board: Board) -> dict[str, str]:
    costs = {
        "float operation": FLOAT_OPERATION,
        "square root": ROOT,
        "inner step of a Givens row": GIVENS_INNER,
        "sample": SAMPLE_WORD,
        "byte of a frame": FRAME_BYTE,
    }
    said = {name: f"{cost.us:g} us: {cost.source}" for name, cost in costs.items()}
    return {**said, "clock": f"figures at {REFERENCE_MHZ:g} MHz, scaled to {board.cpu_mhz:g} MHz"}


def _at(board: Board, us: float) -> float:
    return us * REFERENCE_MHZ / board.cpu_mhz
