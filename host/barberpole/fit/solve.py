"""Bounded least squares: Levenberg-Marquardt on the block normal equations."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from barberpole.fit.gram import Gram, accumulate, solve_scaled
from barberpole.fit.residual import Problem

MAX_STEPS = 40
TOLERANCE = 1e-12  # relative fall of the cost that is still a step
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
    """Fit the `free` parameters (mask (P,)) from start p within the model's bounds."""
    sigma, solution = 0.0, None
    for _ in range(1 if problem.vector else NOISE_BIAS_PASSES):
        solution = descend(problem, p, free, sigma, tick)
        p, sigma = solution.p, solution.gram.rms()
    return solution


def descend(problem: Problem, p: np.ndarray, free: np.ndarray, sigma: float, tick=None) -> Solution:
    """Steps until the cost no longer falls."""
    lower, upper = problem.model.bounds()
    floor = (ROUNDING * float(np.max(np.abs(problem.seen.y), initial=0.0))) ** 2 * problem.n
    gram, damping = accumulate(problem, p, sigma, tick), 1e-6
    for _ in range(MAX_STEPS):
        movable = free & ~_held_by_bound(p, gram, lower, upper)
        step, predicted = _step(gram, movable, damping)
        if predicted <= TOLERANCE * gram.cost + floor:
            return Solution(p, gram, free, True, sigma)
        trial_p = np.clip(p + step, lower, upper)
        trial = accumulate(problem, trial_p, sigma, tick)
        if np.isfinite(trial.cost) and trial.cost < gram.cost:
            p, gram, damping = trial_p, trial, max(damping * 0.1, 1e-12)
        elif damping > 1e8:
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
