"""Of a very long log, a part that stands for it: as many contiguous stretches as there are blocks.

Which effects are missing is searched on the part; the fits and the figures reported are of the whole log.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from barberpole.diagnose.search import Found
from barberpole.fit.fit import Fit, refit
from barberpole.fit.gram import BLOCKS, block_edges
from barberpole.observations import Observations

LONGEST = 40_000  # samples searched: enough to see a hundredth of the noise


def part_of(fit: Fit) -> Fit:
    """The fit itself, or that of the middle of each block where the log is longer than LONGEST."""
    n = fit.problem.n
    if n <= LONGEST:
        return fit
    edges, half = block_edges(n), LONGEST // BLOCKS // 2
    middles = (edges[:-1] + edges[1:]) // 2
    rows = np.concatenate([np.arange(m - half, m + half) for m in middles])
    problem = replace(fit.problem, seen=taken(fit.problem.seen, rows), believed=None)
    return refit(replace(fit, problem=problem), fit.setups, {})


def taken(seen: Observations, rows: np.ndarray) -> Observations:
    """Some of the samples."""
    b_ut = None if seen.b_ut is None else seen.b_ut[:, rows]
    b_mag = None if seen.b_mag is None else seen.b_mag[rows]
    return replace(seen, y=seen.y[:, rows], at=seen.at.take(rows), b_ut=b_ut, b_mag=b_mag, row=seen.row[rows])


def in_full(fit: Fit, found: Sequence[Found]) -> list[Found]:
    """The effects found, each fit repeated on the whole log of `fit`."""
    if not found or found[0].fit.problem.n == fit.problem.n:
        return list(found)
    out, last = [], fit
    for one in found:
        start = dict(zip(one.fit.model.names, (float(v) for v in one.fit.p), strict=True))
        after = refit(last, one.fit.setups, start, one.fit.held)
        drop = 1.0 - after.heldout_rms_lsb / last.heldout_rms_lsb
        out.append(replace(one, fit=after, heldout_drop=drop))
        last = after
    return out
