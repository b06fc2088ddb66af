"""An array's calibration as the firmware takes it: a model and a coil response for each sensor.

    H = M y + B   is   y = G (P H) + b,   M^-1 = diag(G) P with rows of unit length in P,   b = -M^-1 B          (1)
    dh / du = diag(1/G) A^-1 K      the die's field h = (P H) by currents u, A of a coil run (6.3),             (2)
                                    K the coils' µT of one unit

so `misalignment` holds P, `scale` G and `bias` b; (2) is what later power-ups are compared with (6.7).
"""

import hashlib

import numpy as np

from barberpole.arrays.calibrate import OfArray
from barberpole.board import Board
from barberpole.calibration import Calibration
from barberpole.calibration_tables import Residual, SelfcalReference, Value
from barberpole.effects.misalignment import LOWER, UPPER
from barberpole.errors import InputError, must
from barberpole.methods.offset_coil import Affine
from barberpole.modelfile import ModelFile
from barberpole.trajectory import code_table, for_board

STEEPEST = 20.0  # tangent; beyond it another axis of the first sensor lies along this one
TEMP_C = 25.0


def of_each(found: OfArray, board: Board, log_name: str) -> dict[str, Calibration]:
    """A calibration for each sensor, by name. Raises InputError where its axes are not those of the first, about."""
    return {name: _of_one(found, name, board, log_name) for name in found.affine}


def _of_one(found: OfArray, name: str, board: Board, log_name: str) -> Calibration:
    affine = found.affine[name]
    inverse = np.linalg.inv(affine.a)
    gain = np.linalg.norm(inverse, axis=1) * np.sign(np.diag(inverse))
    parameters = {
        **_tilts(inverse, name),
        **{f"scale.{axis}": Value(float(g), 0.0, "LSB/uT") for axis, g in zip("xyz", gain, strict=True)},
        **{f"bias.{axis}": Value(float(b), 0.0, "LSB") for axis, b in zip("xyz", -inverse @ affine.b, strict=True)},
    }
    left_lsb = found.left_ut.get(name, 0.0) * board.scale_lsb_per_ut
    return Calibration(
        model=ModelFile(("misalignment", "scale", "bias"), sensor=board.sensor.name),
        parameters=parameters,
        covariance=np.zeros((len(parameters), len(parameters))),
        residual=Residual(n=0, rms_lsb=left_lsb),
        log_name=log_name,
        log_sha256=hashlib.sha256(repr(affine).encode()).hexdigest(),
        selfcal=_reference(found, name, gain, board),
        easy_axis=board.sensor.easy_axis_index,
        method=f"array {name}",
    )


def _tilts(inverse: np.ndarray, name: str) -> dict[str, Value]:
    """e_ij of P: tangents, as `misalignment` has them."""
    tangent = inverse / np.diag(inverse)[:, None]
    if not np.all(np.abs(tangent) < STEEPEST):
        got = f"those of {name} turned by about a right angle"
        raise InputError(must("the axes of an array's sensors", "along those of the first", got))
    places = {f"{i}{j}": ("xyz".index(i), "xyz".index(j)) for i, j in UPPER + LOWER}
    return {f"misalignment.{key}": Value(float(tangent[at]), 0.0, "rad") for key, at in places.items()}


def _reference(found: OfArray, name: str, gain: np.ndarray, board: Board) -> SelfcalReference | None:
    """(2) of the coil run that the array's calibration holds; None without one."""
    if name not in found.carried:
        return None
    carried: Affine = found.carried[name]
    coil = np.linalg.solve(carried.a, found.affine[name].a)  # A of the run, by S_c sigma_c = M A^-1 (6.8)
    table = code_table(for_board(board), board)
    unit_ut = board.sensor.offset_coil_ut_per_ma * np.asarray(table.unit_ma)
    response = np.linalg.inv(coil) * unit_ut / gain[:, None]
    rows = [tuple(float(v) for v in row) for row in response]
    units = [float(v) for v in table.unit_ma]
    return SelfcalReference(
        gain_ut_per_unit=(_three(rows[0]), _three(rows[1]), _three(rows[2])),
        units_ma=_three(units),
        trajectory=table.id,
        offset_lsb=(0.0, 0.0, 0.0),
        temp_c=TEMP_C,
    )


def _three(values) -> tuple[float, float, float]:
    x, y, z = values
    return x, y, z
