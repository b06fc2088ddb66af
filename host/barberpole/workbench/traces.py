"""A fit as channels to draw: measured, modelled and residual by axis, and everything they may be drawn against."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from barberpole.columns import KNOWN
from barberpole.diagnose.covariates import Covariate, covariates, ripples
from barberpole.fit.fit import Fit
from barberpole.fit.residual import cofactors
from barberpole.log import Log


@dataclass(frozen=True)
class Abscissa:
    """Something to draw a residual against: its name, as in a pattern, and the axis title with the unit.

    of: what gives the values (n,), or for a group of products (m, n), one combination for each residual channel.
    """

    name: str
    title: str
    of: Callable[[], np.ndarray]
    product: bool = False

    @cached_property
    def values(self) -> np.ndarray:
        """Computed when first drawn."""
        return self.of()


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
        periodic = ripples(seen.y, self.residual) if len(self.residual) == len(seen.y) else []
        every = [*covariates(seen, self.field_ut), *periodic]
        found = {c.name: _single(c) for c in every if c.value is not None}
        found = {"t_s": found.pop("t_s"), **found}
        for name, values in self.log.columns.items():
            if name not in KNOWN or name == "supply_v":
                found[name] = Abscissa(name, name, partial(np.take, values, self.row))
        for name in [c.name for c in every if c.value is None]:
            found[name] = Abscissa(name, f"{product_words(name)}, LSB", partial(combination, self, name), product=True)
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


def _single(of: Covariate) -> Abscissa:
    words = f"{of.words} within a period" if of.period else of.words
    value = of.value
    return Abscissa(of.name, f"{words}, {of.unit}" if of.unit else words, lambda: np.asarray(value))


FACTORS = {"temp_c": "temperature", "t_s": "time", "state": "flip state", "field": "field"}


def product_words(name: str) -> str:
    """A group of products as its chip and its axis call it: "x × y field", "flip state × field"."""
    factors = name.split("*")
    if all(factor.startswith("field_") for factor in factors):
        return " × ".join(factor.removeprefix("field_") for factor in factors) + " field"
    return " × ".join(FACTORS.get(factor, factor) for factor in factors)


def combination(traces: Traces, name: str) -> np.ndarray:
    """A group of products combined as each channel's residual follows them (m, n), LSB.

    Least squares beside what any sensor's bias and matrix take, and less that: where the group explains a residual,
    the residual lies on the diagonal (an added-variable plot; Cook and Weisberg 1982, sec. 2.3.3).
    """
    field = traces.field_ut / max(float(np.max(np.abs(traces.field_ut))), 1e-300)
    group = next(c.basis for c in covariates(traces.fit.problem.seen, traces.field_ut) if c.name == name)
    taken = [np.ones_like(field[:1]), field]
    if len(traces.residual) == 1:  # of a magnitude, the matrix takes the squares
        taken += [field[i : i + 1] * field[i:] for i in range(3)]
    base = np.concatenate(taken)
    group = group - _projected(base, group)
    return _projected(group, traces.residual)


def _projected(onto: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The least-squares combinations (m, n) of rows (d, n) that are nearest to y (m, n)."""
    size = np.sqrt(np.maximum(np.sum(onto**2, axis=1), 1e-300))
    gram, right = onto @ onto.T / np.outer(size, size), (onto @ y.T) / size[:, None]
    weights = np.linalg.pinv(gram, rcond=1e-10, hermitian=True) @ right
    return (weights / size[:, None]).T @ onto


def inside(
    traces: Traces,
    against: str,
    x: tuple[float, float],
    y_lsb: tuple[float, float] | None = None,
    channel: int | None = None,
) -> np.ndarray:
    """Samples (mask (n,)) with an abscissa in x and, where given, a residual in y_lsb: of one channel, or of any."""
    values = np.atleast_2d(traces.abscissae[against].values)
    values = values[(channel or 0) if len(values) > 1 else 0]
    chosen = (values >= min(x)) & (values <= max(x))
    if y_lsb is not None:
        wanted = traces.residual if channel is None else traces.residual[channel : channel + 1]
        chosen &= np.any((wanted >= min(y_lsb)) & (wanted <= max(y_lsb)), axis=0)
    return chosen
