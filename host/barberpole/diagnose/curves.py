"""The residual against everything logged, as bin means with their errors: what pictures are drawn from."""

from dataclasses import dataclass

import numpy as np

from barberpole.diagnose.covariates import Covariate
from barberpole.diagnose.evidence import Evidence
from barberpole.fit.noise import Noise

BINS = 20  # of a covariate at most
LEAST = 5  # samples a bin
MOST = 2000  # times a bin's samples


@dataclass(frozen=True)
class Curve:
    """Mean residual (LSB) of one axis in bins of a covariate, with its standard error under the noise found.

    x_name says what x is: the covariate with its unit or, for a group of products, their best combination in LSB, so
    that a group that explains the residual gives the diagonal (an added-variable curve).
    """

    axis: str
    against: str
    x: list[float]
    mean_lsb: list[float]
    error_lsb: list[float]
    x_name: str = ""


def curves(evidence: Evidence) -> list[Curve]:
    """One for each channel and covariate."""
    ground, noise, out = evidence.ground, evidence.white.noise, []
    for channel, covariate, columns in evidence.covariates:
        values, name = covariate.value, f"{covariate.words}, {covariate.unit}" if covariate.unit else covariate.words
        if covariate.period:
            name = f"{covariate.words} within a period, {covariate.unit}"
        if values is None:
            values = _best_combination(evidence, channel, columns)
            name = f"best combination of {_members(covariate)}, LSB"
        x, mean, error = binned(values, ground.residual[channel], noise)
        out.append(Curve(ground.axes[channel], covariate.name, x, mean, error, name))
    return out


def _best_combination(evidence: Evidence, channel: int, columns: np.ndarray) -> np.ndarray:
    """What these columns take of the residual (n,), less what the model's own parameters could take of it."""
    gram, base = evidence.table.total, evidence.baseline
    weights = np.zeros(evidence.design.count)
    weights[columns] = evidence.projection.weights(columns)[0]
    size = np.sqrt(np.maximum(np.diag(gram)[base], 1e-300))
    inverse = np.linalg.pinv(gram[np.ix_(base, base)] / np.outer(size, size), rcond=1e-12, hermitian=True)
    weights[base] -= inverse @ (gram[base] @ weights / size) / size
    return evidence.design.combine(weights)[channel]


def _members(covariate: Covariate) -> str:
    return covariate.name if len(covariate.basis) == 1 else f"{len(covariate.basis)} products {covariate.name}"


def binned(values: np.ndarray, residual: np.ndarray, noise: Noise) -> tuple[list[float], list[float], list[float]]:
    """Mean value, mean residual and its error, bin by bin."""
    place = _places(values)
    count = np.bincount(place)
    x, mean = np.bincount(place, values) / count, np.bincount(place, residual) / count
    spread = np.sqrt(np.maximum(np.bincount(place, residual**2) / count - mean**2, 0.0))
    error = _independent(noise) * spread / np.sqrt(count)
    return x.tolist(), mean.tolist(), error.tolist()


def _places(values: np.ndarray) -> np.ndarray:
    """Number of each sample's bin; no bin is empty.

    Half the edges part the samples evenly and half the range, so that what mostly rests (the rate of a sensor that is
    stepped and held) still shows where it moves. A few distinct values have a bin each.
    """
    distinct = np.unique(values)
    if distinct.size <= BINS:
        return np.searchsorted(distinct, values)
    part = np.arange(1, BINS // 2 + 1) / (BINS // 2 + 0.5)
    even = distinct[0] + (1.0 - part) * (distinct[-1] - distinct[0])
    edges = np.concatenate([np.quantile(values, part), even])
    ordered = np.sort(values)
    least, below, kept = max(values.size // MOST, LEAST), 0, []
    for edge in np.unique(edges):
        at = int(np.searchsorted(ordered, edge, side="right"))
        if at - below >= least and values.size - at >= least:
            kept.append(edge)
            below = at
    return np.searchsorted(np.array(kept), values, side="left")


def _independent(noise: Noise, span: int = 100) -> float:
    """By how much correlated noise enlarges the error of a mean of `span` samples."""
    return float(np.sqrt(noise.shape(np.array([1.0 / span]))[0]))
