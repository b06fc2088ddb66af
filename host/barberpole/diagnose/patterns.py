"""Where a residual fails: its dependence on everything logged, each with a significance and a shape in words."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from barberpole.diagnose.columns import Ground
from barberpole.diagnose.covariates import Covariate, covariates, ripples
from barberpole.diagnose.noise import Noise, estimate
from barberpole.diagnose.table import Design, Projection, Table, project, tabulate
from barberpole.diagnose.tails import LIKELIER, jumps
from barberpole.diagnose.whitening import Whitening

SHOWN = 12  # patterns listed at most
CHANCE = 1e-4  # p-value, corrected for the number of tests, below which a pattern is shown


@dataclass(frozen=True)
class Pattern:
    """A residual on an axis (or of the norm) against a covariate: RMS of the dependence in LSB, chance of it."""

    axis: str
    against: str
    shape: str
    rms_lsb: float
    p_value: float


@dataclass(frozen=True)
class Survey:
    """A residual (m, n) and every covariate in one table; places: (channel, covariate, columns)."""

    residual: np.ndarray
    table: Table
    projection: Projection
    design: Design
    places: list[tuple[int, Covariate, np.ndarray]]
    white: Whitening

    @property
    def everything(self) -> np.ndarray:
        """All covariates' columns."""
        return np.concatenate([columns for _, _, columns in self.places])

    def left_over(self) -> np.ndarray:
        """(m, n): the residual less its least-squares fit by every column."""
        g, last = self.table.total, self.design.count - 1
        size = np.sqrt(np.maximum(np.diag(g)[:last], 1e-300))
        inverse = np.linalg.pinv(g[:last, :last] / np.outer(size, size), rcond=1e-9, hermitian=True)
        weights = np.append(-inverse @ (g[:last, -1] / size) / size, 1.0)
        return self.design.combine(weights)


def survey(ground: Ground, white: Whitening, known: Sequence[np.ndarray] = ()) -> Survey:
    """Residual of a fit against all covariates, with the baseline (and `known` columns) projected off."""
    seen = ground.fit.problem.seen
    channels = ground.residual.shape[0]
    design = Design(channels)
    baseline = [design.add(ground.baseline()), *(design.add(columns) for columns in known)]
    found = covariates(seen, ground.field)
    if channels == 3:
        found += ripples(
            seen.y - ground.residual, ground.residual
        )  # the reading as predicted: its own noise is no cause
    places = [
        (channel, c, design.add_to(channel, c.basis))
        for c in found
        for channel in range(channels)
        if c.channel in (None, channel)
    ]
    design.add(ground.residual[:, None])
    table = tabulate(design, white)
    return Survey(ground.residual, table, project(table, np.concatenate(baseline)), design, places, white)


def background(ground: Ground, known: Sequence[np.ndarray] = ()) -> Noise:
    """The noise left in a residual by all that any covariate or known column can take."""
    level = float(np.mean(ground.residual**2)) or 1.0
    seen = survey(ground, Whitening(Noise(np.full(ground.residual.shape[0], level))), known)
    return estimate(seen.left_over(), "residual", seen.design.kept(), ground.normal)


def patterns(seen: Survey) -> list[Pattern]:
    """The significant ones, strongest first."""
    found, variance = [], seen.projection.rss / max(seen.projection.freedom, 1.0)
    for channel, covariate, columns in seen.places:
        score, rank = seen.projection.score(columns)
        chance = float(max(chi2.sf(score / variance, rank), 1e-300)) if rank else 1.0
        if chance * len(seen.places) < CHANCE:
            found.append((score, _pattern(seen, channel, covariate, columns, score, chance)))
    found.sort(key=lambda item: -item[0])
    return [pattern for _, pattern in found[:SHOWN]]


def _pattern(seen: Survey, channel, covariate, columns, score, chance) -> Pattern:
    rows = float(seen.table.count) / len(seen.white.noise.white)
    rms = float(np.sqrt(max(score, 0.0) / rows * seen.white.noise.white[channel]))
    single = [seen.projection.score(columns[j : j + 1])[0] for j in range(len(columns))]
    return Pattern(_axis(seen, channel), covariate.name, covariate.shapes[int(np.argmax(single))], rms, chance)


def jump_patterns(seen: Survey) -> list[Pattern]:
    """Channels that rest on a level and jump to another: no covariate, but no noise either."""
    found = []
    for channel, gain in enumerate(jumps(seen.residual)):
        if gain > LIKELIER:
            rms = float(np.sqrt(np.mean(seen.residual[channel] ** 2)))
            found.append(Pattern(_axis(seen, channel), "t_s", "jumps between levels", rms, max(np.exp(-gain), 1e-300)))
    return found


def _axis(seen: Survey, channel: int) -> str:
    return "xyz"[channel] if len(seen.residual) == 3 else "norm"
