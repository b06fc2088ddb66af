"""A model with its numbers: what a calibration file stands for, ready to predict, to compensate and to compile."""

from dataclasses import dataclass
from itertools import product

import numpy as np

from barberpole.calibration import Calibration
from barberpole.effects import Conditions, Effect, Setup
from barberpole.errors import InputError, must
from barberpole.model import Model, compose, find_effect
from barberpole.plugins import load_plugins


@dataclass(frozen=True)
class Fitted:
    """Model, parameter vector p (P,), and the conditions that belong to the sensor and not to a sample."""

    model: Model
    p: np.ndarray
    easy_axis: tuple[int, int, int]
    t0_c: float
    raw_polarity: bool

    def conditions(self, **known) -> Conditions:
        """Conditions with this sensor's easy axes, reference temperature and polarity."""
        return Conditions(easy_axis=self.easy_axis, t0_c=self.t0_c, raw_polarity=self.raw_polarity, **known)

    def undo_pair(self, set_xyz, reset_xyz, at: Conditions):
        """Field in µT from a SET and a RESET reading, both with the sign of SET."""
        return self.model.undo_pair(set_xyz, reset_xyz, self.p, at)


def from_calibration(calibration: Calibration) -> Fitted:
    """The fitted model of a calibration. Parameters it could not determine stay at their null.

    Raises InputError if the parameters are not those of the effects it names, or no numbers to compute with: a
    calibration file is text, and text is edited.
    """
    _require_usable(calibration)
    extra = load_plugins(calibration.model.plugins)
    model, flipping = _same_parameters(calibration, extra)
    p = model.null.copy()
    for at, name in enumerate(model.names):
        if name in calibration.parameters:
            p[at] = calibration.parameters[name].value
    return Fitted(model, p, calibration.easy_axis, calibration.t0_c, flipping == "raw")


def _require_usable(calibration: Calibration) -> None:
    for name, found in calibration.parameters.items():
        if not np.isfinite(found.value):
            raise InputError(must(f"the calibration's {name}", "a finite number", found.value))
    if not set(calibration.easy_axis) <= {0, 1, 2}:
        raise InputError(must("the calibration's easy_axis", "one of 0, 1, 2 for each axis", calibration.easy_axis))
    reference = calibration.selfcal
    if reference and not (
        np.all(np.isfinite(reference.gain_ut_per_unit)) and np.all(np.diag(reference.gain_ut_per_unit))
    ):
        raise InputError(must("selfcal.gain_ut_per_unit", "finite, with a response of each axis to its coil", "other"))
    if reference and not (np.all(np.isfinite(reference.units_ma)) and np.all(reference.units_ma)):
        raise InputError(must("selfcal.units_ma", "finite currents other than 0", reference.units_ma))


def _same_parameters(calibration: Calibration, extra: tuple[Effect, ...]) -> tuple[Model, str]:
    """An effect's list of parameters depends on the reference and the flipping of the log: find the ones that fit."""
    names = {*calibration.parameters, *calibration.unobservable}
    settings = calibration.model.settings
    for reference, flipping in product(("vector", "constant"), ("none", "raw", "corrected")):
        setups = {
            find_effect(name, extra).name: Setup(settings.get(name, {}), reference, flipping)
            for name in calibration.model.effects
        }
        model = compose(calibration.model.effects, setups, extra)
        if set(model.names) == names:
            return model, flipping
    raise InputError(must("the calibration", "one whose parameters belong to its effects", ", ".join(sorted(names))))
