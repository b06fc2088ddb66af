"""A fit as channels to draw: measured, modelled and residual by axis, and everything they may be drawn against."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from barberpole.columns import KNOWN
from barberpole.diagnose.covariates import covariates
from barberpole.fit.fit import Fit
from barberpole.fit.residual import cofactors
from barberpole.log import Log


@dataclass(frozen=True)
class Abscissa:
    """Something to draw a residual against: its name, the axis title with the unit, the values (n,)."""

    name: str
    title: str
    values: np.ndarray


@dataclass(frozen=True)
class Traces:
    """n samples of a fit. axes: names of the residual channels; residual (m, n), measured and modelled (3, n), LSB."""

    fit: Fit
    log: Log
    axes: tuple[str, ...]
    residual: np.ndarray
    measured: np.ndarray
    modelled: np.ndarray
    field_ut: np.ndarray

    @cached_property
    def abscissae(self) -> dict[str, Abscissa]:
        """Everything of one value a sample: derived from the field, or logged."""
        seen = self.fit.problem.seen
        found = {
            c.name: Abscissa(c.name, f"{c.words}, {c.unit}" if c.unit else c.words, c.value)
            for c in covariates(seen, self.field_ut)
            if c.value is not None
        }
        found = {"t_s": found.pop("t_s"), **found}
        for name, values in self.log.columns.items():
            if name not in KNOWN or name == "supply_v":
                found[name] = Abscissa(name, name, values[self.row])
        return found

    @property
    def row(self) -> np.ndarray:
        """Row of the log (as it was given to the fit) of each sample."""
        return self.fit.problem.seen.row


def traces_of(fit: Fit, log: Log) -> Traces:
    """Measured and modelled readings of a fit. For a scalar reference the model's reading is the nearest one at which
    the field has the known magnitude."""
    problem = fit.problem
    seen = problem.seen
    if seen.b_ut is not None:
        residual = problem.residual(fit.p)
        return Traces(fit, log, ("x", "y", "z"), residual, seen.y, seen.y - residual, seen.b_ut)
    field, normal = fit.field(), np.empty_like(seen.y)
    norm = np.linalg.norm(field, axis=0)
    for rows in problem.chunks():
        at = seen.at.take(rows)
        _, _, slope = problem.model.linearise(field[:, rows], fit.p, at, field_too=True)
        cofactor, det = cofactors(np.asarray(slope))
        normal[:, rows] = np.sum(cofactor * (field[:, rows] / norm[rows]), axis=1) / det
    steep = np.linalg.norm(normal, axis=0)
    residual = ((norm - problem.magnitude(slice(None))) / steep)[None]
    return Traces(fit, log, ("norm",), residual, seen.y, seen.y - residual * normal / steep, field)


def inside(
    traces: Traces,
    against: str,
    x: tuple[float, float],
    y_lsb: tuple[float, float] | None = None,
    channel: int | None = None,
) -> np.ndarray:
    """Samples (mask (n,)) with an abscissa in x and, where given, a residual in y_lsb: of one channel, or of any."""
    values = traces.abscissae[against].values
    chosen = (values >= min(x)) & (values <= max(x))
    if y_lsb is not None:
        wanted = traces.residual if channel is None else traces.residual[channel : channel + 1]
        chosen &= np.any((wanted >= min(y_lsb)) & (wanted <= max(y_lsb)), axis=0)
    return chosen
