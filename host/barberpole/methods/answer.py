"""What a published method is to the command line, and what it answers."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from barberpole.calibration import Calibration
from barberpole.calibration_tables import Value
from barberpole.fit.fit import Fit
from barberpole.log import Log
from barberpole.methods.quality import Quality
from barberpole.modelfile import ModelFile
from barberpole.sensor import Sensor

Values = dict[str, Value]
JUDGING = ("rms.", "residual.", "peak_to_peak.")  # figures on the answer, which nobody would compensate with


@dataclass(frozen=True)
class Given:
    """What a user may say beside the log.

    reference   of the model file: magnitude_ut, temp_c
    sensor      its easy axes and anisotropy fields
    against     an earlier calibration, where a method carries one over to another
    """

    reference: dict = field(default_factory=dict)
    sensor: Sensor | None = None
    against: Calibration | None = None


@dataclass(frozen=True)
class Answer:
    """The method's own figures, each with standard error and unit; and the fit, where effects can say the same.

    notes: what the figures rest on, in sentences. quality: how well it does, where there is no fit to say so.
    """

    values: Values
    fit: Fit | None = None
    file: ModelFile | None = None
    notes: tuple[str, ...] = ()
    quality: Quality | None = None

    @property
    def parameters(self) -> Values:
        """The figures that make up the calibration."""
        return {name: v for name, v in self.values.items() if not name.startswith(JUDGING)}


@dataclass(frozen=True)
class Method:
    """One published method: its name here, its equations, how the source calls it, and what it needs of a log."""

    name: str
    equations: str
    words: str
    needs: str
    run: Callable[[Log, Given], Answer]


def value(number: float, stderr: float, unit: str) -> Value:
    """A figure as plain floats; stderr NaN where there is none."""
    return Value(float(number), float(stderr), unit)


def per_axis(name: str, numbers, stderrs, unit: str) -> Values:
    """Three figures of one kind, `name.x` to `name.z`; one stderr may stand for all."""
    numbers, stderrs = np.asarray(numbers, float), np.broadcast_to(np.asarray(stderrs, float), 3)
    return {f"{name}.{axis}": value(numbers[i], stderrs[i], unit) for i, axis in enumerate("xyz")}


def matrix_values(name: str, matrix: np.ndarray, stderr: np.ndarray | None, unit: str) -> Values:
    """The elements of a (3, 3) matrix that are not identically zero, `name.11` to `name.33`."""
    spread = np.full((3, 3), np.nan) if stderr is None else stderr
    places = [(i, j) for i in range(3) for j in range(3) if matrix[i, j] != 0.0 or i == j]
    return {f"{name}.{i + 1}{j + 1}": value(matrix[i, j], spread[i, j], unit) for i, j in places}
