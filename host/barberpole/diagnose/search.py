"""Finding the missing effects one after another: score at the null, exact refit of the best, rivals side by side."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from barberpole.diagnose.candidates import Absent, candidates
from barberpole.diagnose.columns import Candidate, Ground, ground_of
from barberpole.diagnose.turning import AnyNoise
from barberpole.diagnose.table import Design, Projection, Table, heldout, project, tabulate
from barberpole.effects import Effect
from barberpole.fit.fit import Fit, refit

ENOUGH = 10.0  # gain in BIC that a name needs
REFITTED = 3  # candidates refitted exactly each round
IN_REACH = 0.3  # of the best linear gain: below it a refit cannot win
MOST = 5  # effects added before giving up


@dataclass(frozen=True)
class Evidence:
    """A fit with every absent effect's columns beside it: where all scores come from."""

    fit: Fit
    ground: Ground
    shapes: list[Candidate]
    places: list[np.ndarray]
    baseline: np.ndarray
    table: Table
    projection: Projection
    noise: AnyNoise

    def gain(self, columns: np.ndarray, forms: int = 1) -> float:
        """Gain in BIC by these columns."""
        score, rank = self.projection.score(columns)
        return bic_gain(self.projection.rss, score, rank, self.table.count, forms)


@dataclass(frozen=True)
class Found:
    """An effect put in: the fit with it, its exact gain in BIC, p-value, rivals that this log cannot tell from it."""

    effect: str
    fit: Fit
    gain: float
    p_value: float
    heldout_drop: float
    rivals: tuple[str, ...]


def bic_gain(rss: float, score: float, rank: int, count: float, forms: int = 1) -> float:
    """-N log(1 - S/RSS) - p log N - 2 log(forms)."""
    share = min(max(score / rss, 0.0), 1.0 - 1e-12)
    return float(-count * np.log1p(-share) - rank * np.log(count) - 2.0 * np.log(forms))


def p_value(evidence: Evidence, columns: np.ndarray) -> float:
    """Chance of a fall this large without the effect."""
    score, rank = evidence.projection.score(columns)
    left = max(evidence.projection.rss - score, 1e-300) / max(evidence.projection.freedom - rank, 1.0)
    return float(max(chi2.sf(score / left, rank), 1e-300)) if rank else 1.0


def examine(fit: Fit, absent: Absent, noise: AnyNoise, extra: Sequence[Effect] = ()) -> Evidence:
    """The Gram matrix of a fit, its absent effects and its residual."""
    ground = ground_of(fit, extra)
    shapes = candidates(ground, absent)
    design = Design(ground.residual.shape[0])
    baseline = design.add(ground.baseline())
    places = [design.add(shape.columns) for shape in shapes]
    design.add(ground.residual[:, None])
    table = tabulate(design, noise)
    return Evidence(fit, ground, shapes, places, baseline, table, project(table, baseline), noise)


def search(fit: Fit, absent: Absent, noise: AnyNoise, extra: Sequence[Effect] = ()) -> tuple[list[Found], Evidence]:
    """Effects in the order found, and the evidence at the end."""
    evidence, found = examine(fit, absent, noise, extra), []
    while len(found) < MOST:
        best = best_addition(evidence, extra)
        if best is None:
            break
        found.append(best)
        evidence = examine(best.fit, absent, noise, extra)
    return found, evidence


def best_addition(evidence: Evidence, extra: Sequence[Effect]) -> Found | None:
    """The effect that gains most by exact refit, if any gains enough."""
    ranked = promising(evidence)
    trials = []
    for gain, at in ranked:
        if gain < IN_REACH * ranked[0][0]:
            continue
        after = _refitted(evidence, at)
        rss, folds = _after(after, evidence.noise, extra)
        rank = evidence.projection.score(evidence.places[at])[1]
        exact = bic_gain(evidence.projection.rss, evidence.projection.rss - rss, rank, evidence.table.count)
        trials.append((exact, at, after, folds))
    trials = sorted((t for t in trials if t[0] > ENOUGH), key=lambda t: -t[0])
    return _found(evidence, trials) if trials else None


def promising(evidence: Evidence) -> list[tuple[float, int]]:
    """(linear gain, shape) of the best effects, one shape each."""
    forms: dict[str, int] = {}
    for shape in evidence.shapes:
        forms[shape.effect.name] = forms.get(shape.effect.name, 0) + shape.tried
    best: dict[str, tuple[float, int]] = {}
    for at, shape in enumerate(evidence.shapes):
        gain = evidence.gain(evidence.places[at], forms[shape.effect.name])
        if gain > max(ENOUGH, best.get(shape.effect.name, (0.0, 0))[0]):
            best[shape.effect.name] = (gain, at)
    return sorted(best.values(), reverse=True)[:REFITTED]


def _refitted(evidence: Evidence, at: int) -> Fit:
    """The exact fit with this form, begun where the linear answer points if the form is linear."""
    shape, name = evidence.shapes[at], evidence.shapes[at].effect.name
    start = {f"{name}.{key}": value for key, value in shape.start.items()}
    if shape.linear:
        weights = evidence.projection.weights(evidence.places[at])[0]
        weights = np.where(shape.even, np.sqrt(np.abs(weights * shape.typical)), weights)
        start |= {f"{name}.{key}": float(w) for key, w in zip(shape.names, weights, strict=True)}
    return refit(evidence.fit, evidence.fit.setups | {name: shape.setup}, start)


def _after(fit: Fit, noise: AnyNoise, extra: Sequence[Effect]) -> tuple[float, np.ndarray]:
    """Whitened residual sum of squares of an exact fit, and its held-out sums by fold."""
    ground = ground_of(fit, extra)
    design = Design(ground.residual.shape[0])
    baseline = design.add(ground.baseline())
    design.add(ground.residual[:, None])
    table = tabulate(design, noise)
    return project(table, baseline).rss, heldout(table, baseline)


def _found(evidence: Evidence, trials: list) -> Found:
    exact, at, after, folds = trials[0]
    rivals = []
    for other_gain, other, _, other_folds in trials[1:]:
        apart = other_folds - folds
        unsure = apart.sum() < 2.0 * np.sqrt(len(apart)) * np.std(apart, ddof=1)
        if exact - other_gain < ENOUGH or (unsure and other_gain > 0.9 * exact):
            rivals.append(evidence.shapes[other].effect.name)
    drop = 1.0 - after.heldout_rms_lsb / evidence.fit.heldout_rms_lsb
    name = evidence.shapes[at].effect.name
    return Found(name, after, exact, p_value(evidence, evidence.places[at]), drop, tuple(rivals))
