"""Where a residual fails: its dependence on everything logged, each with a significance and a shape in words."""

from dataclasses import dataclass

import numpy as np

from barberpole.diagnose.evidence import Evidence
from barberpole.diagnose.tails import LIKELIER, dither, jumps
from barberpole.diagnose.words import shape_in_words

SHOWN = 12  # patterns listed at most
JUMPS = "step: jumps between levels"
CHANCE = 1e-4  # p-value, corrected for the number of tests, below which a pattern is shown


@dataclass(frozen=True)
class Pattern:
    """A residual on an axis (or of the norm) against a covariate: RMS of the dependence in LSB, chance of it."""

    axis: str
    against: str
    shape: str
    rms_lsb: float
    p_value: float


def patterns(evidence: Evidence) -> list[Pattern]:
    """The significant ones, strongest first."""
    found = []
    for channel, covariate, columns in evidence.covariates:
        chance = evidence.p_value(columns)
        if chance * len(evidence.covariates) < CHANCE:
            score = evidence.projection.score(columns)[0]
            found.append((score, _pattern(evidence, channel, covariate, columns, score, chance)))
    found.sort(key=lambda item: -item[0])
    return [pattern for _, pattern in found[:SHOWN]]


def _pattern(evidence: Evidence, channel, covariate, columns, score, chance) -> Pattern:
    rms = float(np.sqrt(max(score, 0.0) / evidence.fit.problem.n * evidence.white.noise.white[channel]))
    projection = evidence.projection
    strongest = int(np.argmax([projection.score(columns[j : j + 1])[0] for j in range(len(columns))]))
    alone = float(projection.weights(columns[strongest : strongest + 1])[0][0])
    shape = shape_in_words(covariate, strongest, alone, projection.weights(columns)[0])
    return Pattern(evidence.ground.axes[channel], covariate.name, shape, rms, chance)


def jump_patterns(evidence: Evidence) -> list[Pattern]:
    """Channels that rest on a level and jump to another: no covariate, but no noise either."""
    found, residual = [], evidence.ground.residual + dither(evidence.fit.problem.seen.y, len(evidence.ground.axes))
    for channel, gain in enumerate(jumps(residual, evidence.ground.normal)):
        if gain > LIKELIER:
            rms = float(np.sqrt(np.mean(residual[channel] ** 2)))
            chance = float(max(np.exp(-gain), 1e-300))
            found.append(Pattern(evidence.ground.axes[channel], "t_s", JUMPS, rms, chance))
    return found
