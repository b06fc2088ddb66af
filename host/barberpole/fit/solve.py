"""Bounded least squares: Levenberg-Marquardt on the block normal equations."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from barberpole.errors import InputError
from barberpole.fit import observability
from barberpole.fit.gram import Gram, Tick, solve_scaled
from barberpole.model import Model

MAX_STEPS = 40
TOLERANCE = 1e-10  # relative fall of the cost that is still a step
ROUGH = 1e-2  # the same while the noise is not yet known: it is then known well enough to go on
MOST_DAMPED = 1e8  # beyond it no step helps
LAST = 1e-8  # relative fall of the cost of a step so short that nothing bends on its way
SAME_NOISE = 0.01  # relative change of the noise that needs no further pass
ROUNDING = 1e-13  # of the largest reading: below this a residual is arithmetic, not data
NOISE_BIAS_PASSES = 3  # a scalar fit needs its own noise to know how much it lengthens the field


@dataclass(frozen=True)
class Solution:
    """Where the fit ended: p (P,), the normal equations there, which parameters were free, whether it converged."""

    p: np.ndarray
    gram: Gram
    free: np.ndarray
    converged: bool

    @cached_property
    def covariance(self) -> np.ndarray:
        """(P, P) in white noise."""
        return observability.covariance(self.gram, self.free)


class Measured(Protocol):
    """What a fit needs of a problem: n samples, the largest reading in LSB, the normal equations at any p, and how much
    of the cost a step may take that needs no pass over the log after it, at a noise in LSB."""

    @property
    def model(self) -> Model: ...
    @property
    def vector(self) -> bool: ...
    @property
    def n(self) -> int: ...
    @property
    def largest(self) -> float: ...

    def straight(self, rms: float) -> float: ...

    def gram(self, p: np.ndarray, sigma: float = 0.0, tick: Tick = None) -> Gram: ...


def minimise(
    problem: Measured, p: np.ndarray, free: np.ndarray, gram: Gram | None = None, tick: Tick = None
) -> Solution:
    """Fit the `free` parameters (mask (P,)) from start p within the model's bounds; `gram` are the normal equations
    there, if they are known.

    Raises InputError where the model cannot be evaluated at the start.
    """
    gram = problem.gram(p, 0.0, tick) if gram is None else gram
    if problem.vector:
        return descend(problem, p, free, gram, TOLERANCE, tick)
    solution = descend(problem, p, free, gram.at_noise(0.0), ROUGH, tick)
    for _ in range(NOISE_BIAS_PASSES):
        sigma = solution.gram.rms()
        if abs(sigma - solution.gram.sigma) <= SAME_NOISE * sigma:
            break
        short = max(problem.straight(sigma), TOLERANCE)
        solution = descend(problem, solution.p, free, solution.gram.at_noise(sigma), short, tick)
    return solution


@np.errstate(over="ignore", invalid="ignore", divide="ignore")  # a step too far costs inf or nan, and is not taken
def descend(problem: Measured, p: np.ndarray, free: np.ndarray, gram: Gram, tolerance: float, tick: Tick) -> Solution:
    """Steps from p, where the normal equations are `gram`, until the cost falls by less than `tolerance` of it.

    The last step, too short to be worth a pass over the log, is taken by the derivatives at hand.
    """
    lower, upper = problem.model.bounds()
    floor, damping = (ROUNDING * problem.largest) ** 2 * problem.n, 1e-6
    if not np.isfinite(gram.cost):
        raise InputError("the log must stay within what the model can invert; got readings beyond it at the start")
    for _ in range(MAX_STEPS):
        movable = free & ~_held_by_bound(p, gram, lower, upper)
        step, predicted = _step(gram, movable, damping)
        if predicted <= tolerance * gram.cost + floor:
            inside = np.all((p + step >= lower) & (p + step <= upper))
            if inside and floor < predicted <= max(problem.straight(gram.rms()), LAST) * gram.cost:
                p, gram = p + step, gram.moved(step)
            return Solution(p, gram, free, True)
        trial_p = np.clip(p + step, lower, upper)
        trial = problem.gram(trial_p, gram.sigma, tick)
        if np.isfinite(trial.cost) and trial.cost < gram.cost:
            p, gram, damping = trial_p, trial, max(damping * 0.1, 1e-12)
        elif damping > MOST_DAMPED:
            return Solution(p, gram, free, False)
        else:
            damping = max(damping * 30.0, 1e-6)
    return Solution(p, gram, free, False)


def _held_by_bound(p, gram, lower, upper):
    push = gram.jr.sum(axis=0)  # downhill direction
    return ((p <= lower) & (push < 0)) | ((p >= upper) & (push > 0))


def _step(gram: Gram, movable: np.ndarray, damping: float) -> tuple[np.ndarray, float]:
    """The damped Gauss-Newton step and the fall of the cost that it promises."""
    step = np.zeros(movable.size)
    if not movable.any():
        return step, 0.0
    h, g = gram.jj.sum(axis=0)[movable][:, movable], gram.jr.sum(axis=0)[movable]
    while True:
        try:
            step[movable] = solve_scaled(h, g, damping)
            break
        except np.linalg.LinAlgError:
            damping = max(damping * 10.0, 1e-10)
    return step, float(2 * step[movable] @ g - step[movable] @ h @ step[movable])
