"""A fit with a prior: what a lot of sensors is known to be stands beside a log too short to tell everything.

    minimise |r(p)|^2 / sigma^2 + sum ((p_j - m_j) / w_j)^2                                                  (1)

with m_j the lot's mean of parameter j and w_j its width. sigma^2 is estimated on the way, the parameters counted only
as far as the log determines them, tr H (H + sigma^2 W)^-1; the covariance is sigma^2 (H + sigma^2 W)^-1, H = J^T J.

Of a scalar reference J is taken on the sphere |B| = K. At the fitted field, which carries the reading's noise, J and r
have that noise in common: harmless where the log determines a parameter, but beside a prior it passes for knowledge.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from barberpole.effects import Effect, find_effect
from barberpole.errors import InputError, must
from barberpole.fit import observability
from barberpole.fit.fit import NOMINAL_MAGNITUDE_UT, Fit, believable, require_columns, setup_of, with_reference
from barberpole.fit.gram import Gram
from barberpole.fit.residual import Problem
from barberpole.fit.start import Linear
from barberpole.model import compose
from barberpole.modelfile import ModelFile
from barberpole.observations import Observations

PASSES = 8  # of the noise
STEPS = 20
UPHILL = 0.1
HALVINGS = 12
SETTLED = 0.02  # of a standard error: a step below it is none
SAME = 1e-2  # relative change of the noise that needs no further pass


@dataclass(frozen=True)
class Prior:
    """name -> (mean, width) in the parameter's unit; from `boards` boards of a lot, in the file `source`.

    vector: whether their field was known as a vector, which decides what misalignment means
    """

    values: dict[str, tuple[float, float]]
    source: str
    sha256: str
    boards: int
    vector: bool
    lot: str | None = None


def fit_with_prior(seen: Observations, file: ModelFile, prior: Prior, extra: Sequence[Effect] = ()) -> Fit:
    """Fit the effects of a model file to observations beside a prior (1); parameters without one are free.

    Raises InputError where the log lacks a column or has another kind of reference than the prior's logs.
    """
    require_columns(seen, file.effects, extra)
    if prior.vector != (seen.reference == "vector"):
        wanted = "from logs of the same reference, all with bx_ut, by_ut, bz_ut or none"
        raise InputError(must("the prior", wanted, "the other kind", prior.source))
    seen = with_reference(seen, file)
    magnitude = float(file.reference.get("magnitude_ut", NOMINAL_MAGNITUDE_UT))
    linear = _linear(prior, seen, magnitude)
    known = {find_effect(name, extra).name: setup_of(seen, linear, file.settings.get(name)) for name in file.effects}
    model = compose(file.effects, known, extra)
    problem = Problem(model, seen, magnitude)
    mean = np.array([prior.values.get(n, (first, 0.0))[0] for n, first in zip(model.names, model.first, strict=True)])
    weight = np.array([prior.values[n][1] ** -2.0 if n in prior.values else 0.0 for n in model.names])
    found = _descend(problem, mean, weight)
    if model.loss:
        problem = replace(problem, believed=believable(problem.residual(found.p)))
        found = _descend(problem, mean, weight)
    free, gram = found.free, found.gram
    covariance = np.zeros((free.size, free.size))
    covariance[np.ix_(free, free)] = found.variance * _inverse(gram.jj.sum(axis=0)[np.ix_(free, free)])
    return Fit(problem, found.p, covariance, gram, free, found.converged, linear, known, tuple(extra))


def _linear(prior: Prior, seen: Observations, magnitude: float) -> Linear:
    """Gain and offset of the lot's mean: no start in closed form asks for a whole turn then."""
    gain = [prior.values.get(f"scale.{axis}", (1.0, 0.0))[0] for axis in "xyz"]
    bias = [prior.values.get(f"bias.{axis}", (0.0, 0.0))[0] for axis in "xyz"]
    largest = magnitude if seen.b_mag is None else float(np.max(seen.b_mag))
    span = largest if seen.b_ut is None else float(np.max(np.abs(seen.b_ut)))
    return Linear(np.diag(gain), np.array(bias), span)


@dataclass(frozen=True)
class _State:
    """Where a descent is: the normal equations with the prior among them, and the variance of the noise."""

    p: np.ndarray
    gram: Gram
    variance: float
    free: np.ndarray
    converged: bool


def _descend(problem: Problem, mean: np.ndarray, weight: np.ndarray) -> _State:
    p, free = mean.copy(), np.ones(mean.size, bool)
    first = np.diff(problem.residual(p), axis=1)
    variance = float(np.mean(first**2)) / 2.0 or 1.0  # far from the solution only neighbours tell the noise
    for _ in range(PASSES):
        noise, converged = variance, False
        sigma = 0.0 if problem.vector else float(np.sqrt(noise))  # a scalar reference's field is lengthened by it
        gram = problem.gram(p, sigma)
        if not np.isfinite(gram.cost):
            raise InputError("the log must stay within what the model can invert; got readings beyond it at the prior")
        for _ in range(STEPS):
            whole = _with(gram, p, mean, noise * weight)
            free = observability.independent(problem.model, whole, np.ones(p.size, bool))
            step, error = _step(whole, noise, free)
            if converged := bool(np.all(np.abs(step) <= SETTLED * error)):
                break
            p, gram = _moved(problem, p, step, gram, mean, noise * weight, sigma)
        variance = _variance(gram, noise * weight, free)
        if abs(variance - noise) <= SAME * noise:
            break
    return _State(p, _with(gram, p, mean, variance * weight), variance, free, converged)


def _with(gram: Gram, p: np.ndarray, mean: np.ndarray, weight: np.ndarray) -> Gram:
    """The normal equations with the prior as a block of its own, which no held-out stretch takes away."""
    return Gram(
        np.concatenate([gram.jj, np.diag(weight)[None]]),
        np.concatenate([gram.jr, (weight * (mean - p))[None]]),
        np.append(gram.rr, 0.0),
        np.append(gram.m, 0.0),
    )


def _step(whole: Gram, variance: float, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The Gauss-Newton step of (1) and the standard errors there."""
    step, error = np.zeros(free.size), np.full(free.size, np.inf)
    inverse = _inverse(whole.jj.sum(axis=0)[np.ix_(free, free)])
    step[free] = inverse @ whole.jr.sum(axis=0)[free]
    error[free] = np.sqrt(variance * np.diag(inverse))
    return step, error


def _moved(problem, p, step, gram, mean, weight, sigma) -> tuple[np.ndarray, Gram]:
    """As far along the step as (1) falls; on the sphere the solution is not quite its lowest point."""
    lower, upper = problem.model.bounds()

    def cost(at: np.ndarray, there: Gram) -> float:
        return there.cost + float(np.sum(weight * (at - mean) ** 2))

    here = cost(p, gram)
    for _ in range(HALVINGS):
        trial = np.clip(p + step, lower, upper)
        there = problem.gram(trial, sigma)
        if np.isfinite(there.cost) and cost(trial, there) <= here * (1.0 + (0.0 if problem.vector else UPHILL)):
            return trial, there
        step = 0.5 * step
    return p, gram


def _variance(gram: Gram, weight: np.ndarray, free: np.ndarray) -> float:
    h = gram.jj.sum(axis=0)[np.ix_(free, free)]
    used = float(np.trace(_inverse(h + np.diag(weight[free])) @ h))
    return gram.cost / max(gram.count - used, 1.0) or 1e-300


def _inverse(h: np.ndarray) -> np.ndarray:
    size = np.sqrt(np.maximum(np.diag(h), 1e-300))
    return np.linalg.inv(h / np.outer(size, size)) / np.outer(size, size)
