"""Pictures for report, workbench and data sheet: each answers one question, in its title, and says it in a sentence.

Functions take plain arrays or the answers of fit, compare, diagnose and calibration, and return a `Figure`. They
decimate what they draw; nothing here is ever fitted.
"""

from barberpole.figures.figure import Figure
from barberpole.figures.parameters import parameters
from barberpole.figures.residual import residual_against, residual_axes, residual_curves
from barberpole.figures.selfcal import error_over_time, gains, points
from barberpole.figures.spectrum import residual_spectrum, spectrum
from barberpole.figures.sphere import coverage, sphere
from barberpole.figures.suspects import suspects
from barberpole.figures.theme import CONFIG, DARK, LIGHT
from barberpole.figures.traces import traces
from barberpole.figures.waterfall import Stage, stages_of_diagnosis, stages_of_history, waterfall

__all__ = [
    "CONFIG",
    "DARK",
    "LIGHT",
    "Figure",
    "Stage",
    "coverage",
    "error_over_time",
    "gains",
    "parameters",
    "points",
    "residual_against",
    "residual_axes",
    "residual_curves",
    "residual_spectrum",
    "spectrum",
    "sphere",
    "stages_of_diagnosis",
    "stages_of_history",
    "suspects",
    "traces",
    "waterfall",
]
