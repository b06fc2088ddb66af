"""The three generated modules as text: bp_board, bp_trajectory, bp_calibration."""

from dataclasses import dataclass

from barberpole.board import Board
from barberpole.calibration import Calibration
from barberpole.driver_board import Driver
from barberpole.fitted import from_calibration
from barberpole.trajectory import CodeTable, code_table, for_board

from barberpole_codegen import coverage, settings
from barberpole_codegen.emit import Function, module, number
from barberpole_codegen.functions import trace_in_frame, trace_undo, trace_undo_coil
from barberpole_codegen.hot import Hot, hot_row, hot_text
from barberpole_codegen.narrow import Precision, narrow
from barberpole_codegen.rows import AUTO, VIPER, RowPath, choose_path
from barberpole_codegen.trace import Program

VERSION = "0.1"
BEYOND_LOG_C = 10.0  # temperatures this far outside the log are tried too


@dataclass(frozen=True)
class Generated:
    """Text by file name, the traced programs, what narrowing costs, and the row in fixed point where one is used."""

    texts: dict[str, str]
    programs: dict[str, Program]
    precision: dict[str, Precision]
    table: CodeTable
    path: RowPath
    hot: Hot | None


def generate(board: Board, calibration: Calibration, path: str = AUTO) -> Generated:
    """All generated text. `path`: "bytecode" or "viper" for the streamed row, "auto" to choose by flip rate.

    Raises a BarberpoleError where board and calibration do not go together.
    """
    table = code_table(for_board(board), board)
    fitted = from_calibration(calibration)
    traced = {
        "undo": trace_undo(fitted),
        "undo_coil": trace_undo_coil(fitted),
        "in_frame": trace_in_frame(fitted),
    }
    programs = {name: narrow(program) for name, program in traced.items()}
    temps_c = _temperatures(calibration)
    precision = {
        "undo": coverage.compensation(traced["undo"], fitted, board, temps_c),
        "undo_coil": coverage.coil_run(traced["undo_coil"], fitted, board, temps_c),
    }
    hot = hot_row(fitted, board, temps_c)
    chosen = choose_path(path, programs, hot, board)
    texts = {
        "bp_board.py": board_text(board),
        "bp_trajectory.py": trajectory_text(board, table),
        "bp_calibration.py": calibration_text(calibration, board, table, programs, precision, chosen.name),
    }
    if hot is not None and chosen.name == VIPER:
        texts["bp_hot.py"] = hot_text(hot, board, calibration.hash, VERSION)
    return Generated(texts, programs, precision, table, chosen, hot)


def board_text(board: Board) -> str:
    title = "bp_board.py: what is soldered."
    return module(title, f"board {board.name}", VERSION, constants=settings.board_constants(board))


def trajectory_text(board: Board | Driver, table: CodeTable) -> str:
    title = f"bp_trajectory.py: {table.points} points of coil current ({table.name}), as DAC codes."
    note = "One bytes object: it stays in flash where the module is frozen or in ROMFS. A list would be copied to RAM."
    return module(title, f"board {board.name}", VERSION, [note], settings.trajectory_constants(table))


def calibration_text(
    calibration: Calibration,
    board: Board,
    table: CodeTable,
    programs: dict[str, Program],
    precision: dict[str, Precision],
    path: str,
) -> str:
    readings = "SET and RESET readings (LSB, both with the sign of SET), temperature (degC), gains over the factory's."
    comments = {
        "undo": (readings, "Field in uT, in the frame of the calibration."),
        "undo_coil": (
            readings,
            "With coil fields (uT): what each die feels, its own coil included, from SET and from RESET.",
        ),
        "in_frame": ("From the field of the dies to the frame of the calibration, uT.",),
    }
    return module(
        "bp_calibration.py: from readings to field.",
        f"calibration {calibration.hash}",
        VERSION,
        [_inverse_note(calibration), *_precision_notes(precision), *_parameter_notes(calibration)],
        settings.calibration_constants(calibration, board, table, path),
        [Function(name, program, comments[name]) for name, program in programs.items()],
    )


def _inverse_note(calibration: Calibration) -> str:
    return f"Undoes, last first: {', '.join(reversed(from_calibration(calibration).model.effects))}."


def _precision_notes(precision: dict[str, Precision]) -> list[str]:
    return [
        f"{name}: within {p.fraction:.1g} of full scale in float32, tried over +-{p.range_ut:g} uT."
        for name, p in precision.items()
    ]


def _parameter_notes(calibration: Calibration) -> list[str]:
    return [
        f"  {name} = {number(p.value)} {p.unit}, standard error {p.stderr:.2g}"
        for name, p in calibration.parameters.items()
    ]


def _temperatures(calibration: Calibration) -> tuple[float, float]:
    seen = calibration.validity
    if seen.temp_min_c is None or seen.temp_max_c is None:
        return coverage.TEMP_C
    return seen.temp_min_c - BEYOND_LOG_C, seen.temp_max_c + BEYOND_LOG_C
