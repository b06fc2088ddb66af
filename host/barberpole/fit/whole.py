"""How well a model does on a whole log, in one pass over it whatever its length."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from barberpole.fit.residual import Problem


@dataclass(frozen=True)
class Figures:
    """Of n samples: RMS error of the calibrated field in µT, of |B|/K - 1 in % (scalar references, else None), RMS
    residual by channel (m,) and white noise from neighbouring residuals in LSB; ranges of field and temperature."""

    n: int
    rms_ut: float
    rms_norm_percent: float | None
    rms_by_channel: np.ndarray
    noise_lsb: float
    field_min_ut: np.ndarray
    field_max_ut: np.ndarray
    b_max_ut: float
    temp_c: tuple[float, float] | None


@dataclass
class _Sums:
    """What a pass adds up. The sums of scatter are about the known magnitude."""

    n: int = 0
    error: float = 0.0
    relative: float = 0.0
    residual: np.ndarray = field(default_factory=lambda: np.zeros(0))
    change: float = 0.0
    before: np.ndarray | None = None
    low: np.ndarray = field(default_factory=lambda: np.full(3, np.inf))
    high: np.ndarray = field(default_factory=lambda: np.full(3, -np.inf))
    longest: float = 0.0
    temp: tuple[float, float] | None = None


def figures(problems: Iterable[Problem], p: np.ndarray) -> Figures:
    """Problems are the pieces of one log, in order; p (P,) the parameters of their model."""
    sums = _Sums()
    channels = 1
    for problem in problems:
        channels = problem.residuals_per_sample
        for rows in problem.chunks():
            _add(sums, problem, p, rows)
    n = max(sums.n, 1)
    relative = None if channels == 3 else float(100.0 * np.sqrt(sums.relative / n))
    # neighbours differ by twice the variance (von Neumann), whatever varies slowly
    noise = np.sqrt(sums.change / (2.0 * channels * (n - 1))) if n > 2 else np.nan
    rms_ut = float(np.sqrt(sums.error / (n * channels)))
    by_channel = np.sqrt(sums.residual / n)
    ranges = (sums.low, sums.high, float(np.sqrt(sums.longest)), sums.temp)
    return Figures(sums.n, rms_ut, relative, by_channel, float(noise), *ranges)


def _add(sums: _Sums, problem: Problem, p: np.ndarray, rows: slice) -> None:
    seen = problem.seen
    field_ut = problem.model.invert(seen.y[:, rows], p, seen.at.take(rows))
    known = field_ut if seen.b_ut is None else seen.b_ut[:, rows]
    if seen.b_ut is None:
        magnitude = problem.magnitude(rows)
        apart = np.sqrt(np.sum(field_ut * field_ut, axis=0)) - magnitude
        sums.relative += float(np.sum((apart / magnitude) ** 2))
    else:
        apart = field_ut - known
    sums.error += float(np.sum(apart * apart))
    residual = problem.residual_of(p, rows)
    linked = residual if sums.before is None else np.hstack([sums.before, residual])
    sums.change += float(np.sum(np.diff(linked, axis=1) ** 2))
    sums.residual = np.sum(residual * residual, axis=1) + (sums.residual if sums.n else 0.0)
    sums.before = residual[:, -1:]
    sums.n += residual.shape[1]
    sums.low, sums.high = np.minimum(sums.low, known.min(axis=1)), np.maximum(sums.high, known.max(axis=1))
    sums.longest = max(sums.longest, float(np.max(np.sum(known * known, axis=0))))
    if isinstance(temp := seen.at.temp_c, np.ndarray):
        low, high = sums.temp or (np.inf, -np.inf)
        sums.temp = (min(low, float(temp[rows].min())), max(high, float(temp[rows].max())))
