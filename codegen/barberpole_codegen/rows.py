"""What a streamed row costs, by each path, and which path is taken: bytecode where it fits, viper above.

Where the program samples, half a flip cycle is settling and sampling, and after RESET the row; what does not fit
stretches the cycle. Where timers sample into a ring, a row may take a whole cycle; what does not fit is lost.
Operations of native code are counted in the source of firmware/bp_fixed.py.
"""

from dataclasses import dataclass

from barberpole.board import Board
from barberpole.errors import InputError, LimitError, must

from barberpole_codegen.costs import AXIS, CALL, PACK, RING, VIPER_OPERATION, WORD, at_clock, program_us
from barberpole_codegen.hot import Hot
from barberpole_codegen.trace import Program

ROW_BYTES = 69  # of a streamed frame before base64
SUMS, FIGURES = 11, 8  # of a row: what goes in, and what comes out as floats


# Operations in firmware/bp_fixed.py, counted in its source: of an instruction, and of one turn of each loop.
PRODUCT, SUM, TAKE, FLOAT, NORMALISE, COPY, CRC, BASE64, SUM24 = 47, 42, 37, 43, 5, 7, 17, 35, 22
FAST_CALLS = 14  # of native code, in bp_fast.FastRow.frame
SHORTEST = 29  # turns that bring the smallest number to the left: a coil at rest has one

ON_CHIP = "stm32f4_adc"  # is sampled by timers

AUTO, BYTECODE, VIPER = "auto", "bytecode", "viper"


@dataclass(frozen=True)
class RowPath:
    """How a streamed row is made, and why."""

    name: str
    why: str


def row_us(programs: dict[str, Program], hot: Hot | None, board: Board) -> dict[str, dict[str, float]]:
    """Estimated µs of the parts of a streamed row, by path. The check sum of a frame is native on both."""
    half = native_us(board, 3 * board.adc.samples_per_half * SUM24) + at_clock(board, 3 * AXIS.us + 5 * WORD.us)
    timed = board.adc.part == ON_CHIP
    sums = {"sums_of_a_cycle": 2 * half + at_clock(board, RING.us)} if timed else {"sums_of_half_a_cycle": half}
    frame = native_us(board, ROW_BYTES * CRC)
    slow = {"undo": program_us(programs["undo"], board), "pack": at_clock(board, 2 * SUMS * PACK.us)}
    paths = {BYTECODE: {**sums, **slow, "frame": frame + at_clock(board, 4 * CALL.us)}}
    if hot is not None:
        count = hot.count()
        arithmetic = SUMS * TAKE + count["products"] * PRODUCT + count["sums"] * SUM
        figures = FIGURES * (FLOAT + SHORTEST * NORMALISE + 4 * COPY)
        frame += native_us(board, ROW_BYTES // 3 * BASE64) + at_clock(board, FAST_CALLS * CALL.us)
        fast = {"undo": native_us(board, arithmetic), "pack": native_us(board, figures)}
        paths[VIPER] = {**sums, **fast, "frame": frame}
    return paths


def native_us(board: Board, operations: int) -> float:
    """Estimated time of counted operations in viper."""
    return at_clock(board, operations * VIPER_OPERATION.us)


def free_us(board: Board) -> float:
    """What sampling leaves for a row: of half a cycle; of a whole one where timers sample into a ring meanwhile."""
    if board.adc.part == ON_CHIP:
        return 1e6 / board.flip.rate_hz
    return 0.5e6 / board.flip.rate_hz - sampling_us(board)


def sampling_us(board: Board) -> float:
    """What half a flip cycle needs for its pulse, settling and samples; the first sample may just have been missed."""
    conversions = board.adc.samples_per_half + 1
    return board.flip.pulse_us + board.flip.settle_us + 1e6 * conversions / board.adc.sample_hz


def choose_path(asked: str, programs: dict[str, Program], hot: Hot | None, board: Board) -> RowPath:
    """Bytecode where a row fits beside the sampling of a flip cycle, viper above. Raises InputError or LimitError."""
    if asked not in (AUTO, BYTECODE, VIPER):
        raise InputError(must("the path of a row", f"one of {AUTO}, {BYTECODE}, {VIPER}", repr(asked)))
    if asked == VIPER and hot is None:
        raise LimitError(must("the calibration", "one whose inverse fits into fixed point", "a range that does not"))
    needs = {name: sum(parts.values()) for name, parts in row_us(programs, hot, board).items()}
    left = free_us(board)
    says = f"at {board.flip.rate_hz:g} Hz sampling leaves {left:.0f} us for a row; " + ", ".join(
        f"a row needs {us:.0f} us in {name}" for name, us in needs.items()
    )
    if asked != AUTO:
        return RowPath(asked, f"asked for; {says}")
    if hot is None:
        return RowPath(BYTECODE, f"the calibration's range does not fit into fixed point; {says}")
    return RowPath(BYTECODE if needs[BYTECODE] <= left else VIPER, says)
