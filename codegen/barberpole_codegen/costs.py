"""µs of MicroPython's operations, each with its source; times are counted operations times these.

Nothing was timed on silicon.
"""

from dataclasses import dataclass

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
AXIS = Cost(12.0, "estimated: bytecode around the native sum of an axis and the tests of its ends")
WORD = Cost(9.2, "220 us for the sum of 16 x 3 samples in bytecode; a three-byte word is counted as two")
ROOT = Cost(12.0, "estimated: a float operation and a call")
RING = Cost(150.0, "estimated: bytecode that finds a cycle in the ring and looks twice whether it is whole")
VIPER_OPERATION = Cost(0.036, "4.5 instructions of Thumb (as compiled), 1.3 cycles each")
CALL = Cost(4.0, "estimated: bytecode around a call of native code with its arguments")
PACK = Cost(6.0, "estimated: bytecode that reads one figure and hands it to struct.pack")


def program_us(program: Program, board: Board) -> float:
    """Estimated time of one call."""
    count = program.count()
    roots = count.get(SQRT, 0)
    return at_clock(board, (sum(count.values()) - roots) * FLOAT_OPERATION.us + roots * ROOT.us)


def at_clock(board: Board, us: float) -> float:
    """`us` at 168 MHz, at the board's clock."""
    return us * REFERENCE_MHZ / board.cpu_mhz
