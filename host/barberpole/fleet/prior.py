"""A lot's distribution as the prior of a new board's fit."""

import numpy as np

from barberpole.calibration_tables import PriorTable
from barberpole.errors import InputError, must
from barberpole.fit.prior import Prior
from barberpole.fleet.spread import Spread, spreads
from barberpole.fleet.table import Fleet, of_lot
from barberpole.modelfile import ModelFile

LEAST = 5  # boards: of fewer, the scatter is hardly known


def prior_of(fleet: Fleet, file: ModelFile, lot: str | None = None) -> Prior:
    """Mean and width of each parameter over the boards of a fleet, one calibration each.

    The width is what a further board scatters by: between the boards, and the lot's mean by what it is uncertain. It is
    taken at the upper end where few boards leave it open (Student's t against the normal distribution).
    Raises InputError where the fleet's model is another one, or its boards are too few.
    """
    if fleet.model.effects != file.effects or fleet.model.settings != file.settings:
        got = f"one of {', '.join(fleet.model.effects)}"
        raise InputError(must("the prior", f"a fleet of the model {', '.join(file.effects)}", got, fleet.path))
    rows = of_lot(fleet, lot).latest()
    vector = {row["reference"] == "vector" for row in rows}
    if len(rows) < LEAST or len(vector) != 1:
        got = f"{len(rows)} of {'one kind' if len(vector) == 1 else 'several kinds'} of reference"
        raise InputError(must("the prior", f"a fleet of at least {LEAST} boards fitted alike", got, fleet.path))
    values = {one.name: (one.mean, _width(one)) for one in spreads(rows)}
    return Prior(values, fleet.path.name, fleet.sha256, len(rows), vector.pop(), lot)


def stated(prior: Prior) -> PriorTable:
    """The prior as a calibration file states it."""
    mean = {name: value for name, (value, _) in prior.values.items()}
    width = {name: value for name, (_, value) in prior.values.items()}
    return PriorTable(prior.source, prior.sha256, prior.boards, mean, width, prior.lot)


def _width(one: Spread) -> float:
    """Standard deviation of a further board's value, given the scatter and the mean of those seen."""
    freedom = max(one.boards - 1.0, 3.0)
    tau2 = one.tau**2 * freedom / (freedom - 2.0)  # variance of Student's t
    floor = (0.1 * one.stderr) ** 2  # where no scatter is seen the lot is still not known exactly
    return float(np.sqrt(tau2 + one.mean_stderr**2 + floor))
