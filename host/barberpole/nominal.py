"""The calibration of a board that was never calibrated: what the data sheets say, with their tolerances."""

import numpy as np

from barberpole.board import Board
from barberpole.calibration import Calibration
from barberpole.calibration_tables import Residual, Value
from barberpole.modelfile import ModelFile

GAIN_TOLERANCE = 0.25  # of a data sheet's typical sensitivity; what the first log replaces
BIAS_TOLERANCE_UT = 50.0


def nominal(board: Board) -> Calibration:
    """Bias 0 and the sensitivity that sensor, supply and converter add up to, before any measurement."""
    scale = board.scale_lsb_per_ut
    bias = {f"bias.{axis}": Value(0.0, BIAS_TOLERANCE_UT * scale, "LSB") for axis in "xyz"}
    gain = {f"scale.{axis}": Value(scale, GAIN_TOLERANCE * scale, "LSB/uT") for axis in "xyz"}
    parameters = gain | bias
    return Calibration(
        model=ModelFile(("bias", "scale"), sensor=board.sensor.name),
        parameters=parameters,
        covariance=np.diag([value.stderr**2 for value in parameters.values()]),
        residual=Residual(n=0, rms_lsb=GAIN_TOLERANCE * scale * board.sensor.range_ut),
        log_name="data sheets",
        log_sha256="",
        easy_axis=board.sensor.easy_axis_index,
        method="nominal",
    )
