"""Standard errors that hold where the textbook's do not: by how much each is larger than that of white noise.

    C = H^-1 (J^T R J) H^-1,   H = J^T J                                             (1)

R is the covariance of the residual. White, C = sigma^2 H^-1. Where the residual's spectrum says otherwise, R follows
from the power law fitted to it (`fit.noise`), and J^T R J = sum_f S(f) J(f)* J(f). Where the residual of one stretch of
the log pulls parameters another way than that of the others (a magnet passed by, a missing effect), R is taken from
the ten stretches themselves: J^T R J = sum_b g_b g_b^T, g_b = J_b^T r_b (Liang and Zeger 1986). Few residuals widen the
interval as Student's distribution does. A parameter that the log leaves open, which stays at its null, leaves open
what shares its column.
"""

from typing import TYPE_CHECKING

import numpy as np
from scipy.special import chdtri, stdtrit

from barberpole.fit.affine import TOGETHER
from barberpole.fit.noise import expected, frequencies
from barberpole.fit.observability import BASIC
from barberpole.fit.residual import CHUNK, Problem
from barberpole.fit.solve import ROUNDING

if TYPE_CHECKING:
    from barberpole.fit.fit import Fit

LEAST = 200  # samples that tell a colour
SEGMENT = 16384  # samples that are transformed at once; what is longer apart is taken for independent
PADDED = 2  # times its length to which a segment is filled up: power swings slower than the segment too
SLOW = 40  # part of the spectrum, from below, in which colour shows
RED = 4.0  # standard deviations that it must stand out there
SELDOM = 1e-4  # how often stretches of white noise disagree so much
WIDE = 1.96  # normal standard deviations of a 95 % interval
OPEN = 10.0  # times its typical size, that a basic parameter which is left open may have


def factors(fit: "Fit") -> np.ndarray:
    """(P,) by which the standard errors of white noise are to be multiplied; at least 1."""
    free = np.flatnonzero(fit.free)
    variance = fit.gram.cost / max(fit.gram.count - free.size, 1)
    out = np.ones(fit.free.size)
    if not free.size or variance <= 0.0:
        return out
    inverse = fit.white[np.ix_(free, free)] / variance
    white = np.maximum(np.diag(inverse), 1e-300) * variance
    more = np.maximum(_by_stretches(fit, free, inverse, white), _by_spectrum(fit, free, inverse, white))
    few = (stdtrit(max(fit.gram.count - free.size, 1), 0.975) / WIDE) ** 2
    out[free] = np.sqrt(np.maximum(more, few) + _left_open(fit, free, inverse, white))
    return out


def _by_stretches(fit: "Fit", free: np.ndarray, inverse: np.ndarray, white: np.ndarray) -> np.ndarray:
    """Variances of (1) over the white ones with R from the stretches of the log, 1 where these agree."""
    stretches = len(fit.gram.jr)
    if fit.gram.count < stretches * (free.size + stretches):
        return np.ones(free.size)
    pull = fit.gram.jr[:, free]
    pull = pull - pull.mean(axis=0)
    ratio = stretches / (stretches - 1) * np.sum((pull @ inverse) ** 2, axis=0) / white
    wide = (stdtrit(stretches - 1, 0.975) / WIDE) ** 2
    return np.where(ratio > chdtri(stretches - 1, SELDOM) / (stretches - 1), wide * ratio, 1.0)


def _by_spectrum(fit: "Fit", free: np.ndarray, inverse: np.ndarray, white: np.ndarray) -> np.ndarray:
    """The same with R from the power law of the residual, 1 where that is white."""
    problem = fit.problem
    if fit.whole is not None or problem.n < LEAST:
        return np.ones(free.size)
    summed, squares = problem.neighbours(fit.p)
    noisy = squares > problem.n * (ROUNDING * problem.largest) ** 2  # a dead axis leaves arithmetic, not noise
    if not noisy.any() or not _reddened(summed[noisy], squares[noisy] / problem.n):
        return np.ones(free.size)
    residual = problem.counting(fit.p)
    normal = None if problem.vector else problem.normal(fit.p)
    first = slice(0, min(SEGMENT, problem.n))
    kept = _kept(_columns(problem, fit.p, first)[:, free], inverse)
    f = frequencies(PADDED * first.stop)
    found = expected(residual[noisy, first], f, kept[noisy], None if normal is None else normal[:, first])
    if found is None:
        return np.ones(free.size)
    spectrum = np.full((noisy.size, f.size), 1e-300)
    spectrum[noisy] = found
    middle = _in_colour(problem, fit.p, free, np.log(f), np.log(spectrum), normal)
    return np.maximum(np.einsum("ij,jk,ki->i", inverse, middle, inverse) / white, 1.0)


def _kept(columns: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    """(m, n // 2 + 1): the part of white noise that a fit with derivatives (m, P, n) leaves at each frequency."""
    seen = np.fft.rfft(columns, axis=2)
    taken = np.real(np.einsum("mpf,pq,mqf->mf", seen.conj(), inverse, seen, optimize=True)) / columns.shape[2]
    return np.clip(1.0 - taken, 0.0, 1.0)


def _reddened(summed: np.ndarray, variance: np.ndarray) -> bool:
    """Whether the slow part of residuals holds more power than white noise would put there: given are sums of
    neighbours (m, k), which are white where the residual is, and its variances (m,)."""
    n = TOGETHER * summed.shape[1]
    slow = np.abs(np.fft.rfft(summed, axis=1)[:, 1 : max(n // (2 * SLOW), 1) + 1]) ** 2
    return bool(np.mean(slow / (n * variance[:, None])) > 1.0 + RED / np.sqrt(slow.size))


def _in_colour(
    problem: Problem, p: np.ndarray, free: np.ndarray, log_f: np.ndarray, log_s: np.ndarray, normal: np.ndarray | None
) -> np.ndarray:
    """J^T R J, summed over segments. Of a scalar reference the noise is that of the axes, along the normal (3, n)."""
    middle = np.zeros((free.size, free.size))
    for first in range(0, problem.n, SEGMENT):
        rows = slice(first, min(first + SEGMENT, problem.n))
        columns = _columns(problem, p, rows)
        long = PADDED * (rows.stop - rows.start)
        f = frequencies(long)
        twice = np.where((f == 0.5) | (np.arange(f.size) == 0), 1.0, 2.0) / long
        for channel in range(3):
            j = columns[channel] if normal is None else columns[0] * normal[channel, rows]
            power = np.exp(np.interp(np.log(f), log_f, log_s[channel if normal is None else 0]))
            seen = np.fft.rfft(j[free], long, axis=1)
            middle += np.real((seen * (twice * power)) @ seen.conj().T)
    return middle


def _columns(problem: Problem, p: np.ndarray, rows: slice) -> np.ndarray:
    """(m, P, k) derivatives of the residuals of some samples."""
    linearise, size = problem.linearisation(p), problem.n if problem.model.memory else CHUNK
    if size >= problem.n:
        return linearise(slice(0, problem.n))[1][:, :, rows]
    chunks = [slice(a, min(a + size, rows.stop)) for a in range(rows.start, rows.stop, size)]
    return np.concatenate([linearise(chunk)[1] for chunk in chunks], axis=2)


def _left_open(fit: "Fit", free: np.ndarray, inverse: np.ndarray, white: np.ndarray) -> np.ndarray:
    """What parameters that the log leaves open may add to the variances, over the white ones."""
    h = fit.gram.jj.sum(axis=0)
    more = np.zeros(free.size)
    for k, (name, param) in enumerate(zip(fit.model.names, fit.model.params, strict=True)):
        if fit.free[k] or name in fit.held or param.inner:
            continue
        size = abs(param.typical or 0.0) * (OPEN if name.split(".")[0] in BASIC else 1.0)
        more += (inverse @ h[free, k] * size) ** 2
    return more / white
