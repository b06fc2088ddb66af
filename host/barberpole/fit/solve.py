"""Bounded least squares: Levenberg-Marquardt on the block normal equations."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from barberpole.errors import InputError
from barberpole.fit.gram import Gram, accumulate, solve_scaled
from barberpole.fit.residual import Problem

MAX_STEPS = 40
TOLERANCE = 1e-10  # relative fall of the cost that is still a step
ROUGH = 1e-4  # the same while the noise is not yet known
MOST_DAMPED = 1e8  # beyond it no step helps
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
    sigma: float


def minimise(problem: Problem, p: np.ndarray, free: np.ndarray, tick: Callable[[int], None] | None = None) -> Solution:
    """Fit the `free` parameters (mask (P,)) from start p within the model's bounds.

    Raises InputError where the model cannot be evaluated at the start.
    """
    if problem.vector:
        return descend(problem, p, free, 0.0, TOLERANCE, tick)
    solution = descend(problem, p, free, 0.0, ROUGH, tick)
    for _ in range(NOISE_BIAS_PASSES):
        sigma = solution.gram.rms()
        if abs(sigma - solution.sigma) <= SAME_NOISE * sigma:
            break
        solution = descend(problem, solution.p, free, sigma, TOLERANCE, tick)
    return solution


@np.errstate(over="ignore", invalid="ignore", divide="ignore")  # a step too far costs inf or nan, and is not taken
def descend(problem: Problem, p: np.ndarray, free: np.ndarray, sigma: float, tolerance: float, tick=None) -> Solution:
    """Steps until the cost falls by less than `tolerance` of it."""
    lower, upper = problem.model.bounds()
    floor = (ROUNDING * float(np.max(np.abs(problem.seen.y), initial=0.0))) ** 2 * problem.n
    gram, damping = accumulate(problem, p, sigma, tick), 1e-6
    if not np.isfinite(gram.cost):
        raise InputError("the log must stay within what the model can invert; got readings beyond it at the start")
    for _ in range(MAX_STEPS):
        movable = free & ~_held_by_bound(p, gram, lower, upper)
        step, predicted = _step(gram, movable, damping)
        if predicted <= tolerance * gram.cost + floor:
            return Solution(p, gram, free, True, sigma)
        trial_p = np.clip(p + step, lower, upper)
        trial = accumulate(problem, trial_p, sigma, tick)
        if np.isfinite(trial.cost) and trial.cost < gram.cost:
            p, gram, damping = trial_p, trial, max(damping * 0.1, 1e-12)
        elif damping > MOST_DAMPED:
            return Solution(p, gram, free, False, sigma)
        else:
            damping = max(damping * 30.0, 1e-6)
    return Solution(p, gram, free, False, sigma)


def _held_by_bound(p, gram, lower, upper):
    push = gram.jr.sum(axis=0)  # downhill direction
    return ((p <= lower) & (push < 0)) | ((p >= upper) & (push > 0))


def _step(gram: Gram, movable: np.ndarray, damping: float) -> tuple[np.ndarray, float]:
    """The damped Gauss-Newton step and the fall of the cost that it promises."""
    step = np.zeros(movable.size)
    if not movable.any():
        return step, 0.0
    h, g = gram.jj.sum(axis=0)[np.ix_(movable, movable)], gram.jr.sum(axis=0)[movable]
    while True:
        try:
            step[movable] = solve_scaled(h, g, damping)
            break
        except np.linalg.LinAlgError:
            damping = max(damping * 10.0, 1e-10)
    return step, float(2 * step[movable] @ g - step[movable] @ h @ step[movable])
