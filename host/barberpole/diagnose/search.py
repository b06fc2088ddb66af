"""Finding the missing effects one after another: score at the null, exact refit of the best, rivals side by side."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from barberpole.diagnose.candidates import Absent, candidates
from barberpole.diagnose.columns import Candidate, Ground, ground_of
from barberpole.diagnose.table import Design, Projection, Table, heldout, project, tabulate
from barberpole.diagnose.tails import LIKELIER, wrong_readings
from barberpole.diagnose.whitening import Whitening
from barberpole.effects import Effect
from barberpole.errors import InputError
from barberpole.fit.fit import Fit, believable, refit, setup_of

ENOUGH = 10.0  # gain in BIC that a name needs
REFITTED = 3  # candidates refitted exactly each round
IN_REACH = 0.3  # of the best linear gain: below it a refit cannot win
NEARLY = 0.9  # of the best gain: a rival whose held-out error is not clearly worse is not excluded
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
    white: Whitening

    def gain(self, columns: np.ndarray, forms: int = 1) -> float:
        """Gain in BIC by these columns."""
        score, rank = self.projection.score(columns)
        return bic_gain(self.projection.rss, score, rank, self.table.count, forms)


@dataclass(frozen=True)
class Found:
    """An effect put in: the fit with it, its exact gain in BIC, how much it takes off the whitened sum of squares, its
    p-value, rivals that this log cannot tell from it."""

    effect: str
    fit: Fit
    gain: float
    fall: float
    p_value: float
    heldout_drop: float
    rivals: tuple[str, ...] = ()


@dataclass(frozen=True)
class Trial:
    """A candidate refitted exactly: gain in BIC, fall of the whitened sum of squares, held-out sums by fold."""

    candidate: Candidate
    fit: Fit
    gain: float
    fall: float
    folds: np.ndarray


def bic_gain(rss: float, score: float, rank: int, count: float, forms: int = 1) -> float:
    """-N log(1 - S/RSS) - p log N - 2 log(forms)."""
    share = min(max(score / rss, 0.0), 1.0 - 1e-12)
    return float(-count * np.log1p(-share) - rank * np.log(count) - 2.0 * np.log(forms))


def p_value(evidence: Evidence, columns: np.ndarray) -> float:
    """Chance of a fall this large without the effect."""
    score, rank = evidence.projection.score(columns)
    left = max(evidence.projection.rss - score, 1e-300) / max(evidence.projection.freedom - rank, 1.0)
    return float(max(chi2.sf(score / left, rank), 1e-300)) if rank else 1.0


def examine(fit: Fit, absent: Absent, white: Whitening, extra: Sequence[Effect] = ()) -> Evidence:
    """The Gram matrix of a fit, its absent effects and its residual."""
    ground = ground_of(fit, extra)
    shapes = candidates(ground, absent)
    design = Design(ground.residual.shape[0])
    baseline = design.add(ground.baseline())
    places = [design.add(shape.columns) for shape in shapes]
    design.add(ground.residual[:, None])
    table = tabulate(design, white)
    return Evidence(fit, ground, shapes, places, baseline, table, project(table, baseline), white)


def search(fit: Fit, absent: Absent, white: Whitening, extra: Sequence[Effect] = ()) -> tuple[list[Found], Evidence]:
    """Effects in the order found, and the evidence at the end."""
    evidence, found = examine(fit, absent, white, extra), []
    while len(found) < MOST:
        best = best_addition(evidence, extra) or doubtful_readings(evidence, absent)
        if best is None:
            break
        found.append(best)
        evidence = examine(best.fit, absent, white, extra)
    return found, evidence


def best_addition(evidence: Evidence, extra: Sequence[Effect]) -> Found | None:
    """The effect that gains most by exact refit, if any gains enough."""
    ranked = promising(evidence)
    trials = [attempt(evidence, at, extra) for gain, at in ranked if gain >= IN_REACH * ranked[0][0]]
    worth = sorted((t for t in trials if t and t.gain > ENOUGH), key=lambda t: -t.gain)
    return _found(evidence, worth) if worth else None


def attempt(evidence: Evidence, at: int, extra: Sequence[Effect]) -> Trial | None:
    """Refit with a candidate; None where that fails."""
    try:
        after = _refitted(evidence, at)
    except InputError:  # its start lies beyond what can be inverted
        return None
    rss, folds = whitened_rss(after, evidence.white, extra)
    rank = int(after.free.sum() - evidence.fit.free.sum())
    fall = evidence.projection.rss - rss
    gain = bic_gain(evidence.projection.rss, fall, rank, evidence.table.count, evidence.shapes[at].tried)
    return Trial(evidence.shapes[at], after, gain, fall, folds)


def doubtful_readings(evidence: Evidence, absent: Absent) -> Found | None:
    """The effect that weighs single wrong readings down, if there are any and the model lacks it."""
    effect = next((e for e in absent.effects if e.loss and e.name not in evidence.fit.model.effects), None)
    if effect is None:
        return None
    residual = evidence.ground.residual
    z = np.concatenate([evidence.white.apply(c, row[None]) for c, row in enumerate(residual)])
    gain = wrong_readings(z)
    if gain <= LIKELIER:
        return None
    setup = setup_of(evidence.fit.problem.seen, evidence.fit.linear, absent.settings.get(effect.name))
    after = refit(evidence.fit, evidence.fit.setups | {effect.name: setup}, {})
    z = z * believable(residual)
    fall = evidence.projection.rss - float(np.sum(z * z))
    drop = 1.0 - after.heldout_rms_lsb / evidence.fit.heldout_rms_lsb
    return Found(effect.name, after, 2.0 * gain, fall, float(max(np.exp(-gain), 1e-300)), drop)


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


def whitened_rss(fit: Fit, white: Whitening, extra: Sequence[Effect]) -> tuple[float, np.ndarray]:
    """Whitened residual sum of squares of an exact fit, and its held-out sums by fold."""
    ground = ground_of(fit, extra)
    design = Design(ground.residual.shape[0])
    baseline = design.add(ground.baseline())
    design.add(ground.residual[:, None])
    table = tabulate(design, white)
    return project(table, baseline).rss, heldout(table, baseline)


def _found(evidence: Evidence, trials: list[Trial]) -> Found:
    best, rivals = trials[0], []
    for other in trials[1:]:
        apart = other.folds - best.folds
        unsure = apart.sum() < 2.0 * np.sqrt(len(apart)) * np.std(apart, ddof=1)
        if best.gain - other.gain < ENOUGH or (unsure and other.gain > NEARLY * best.gain):
            rivals.append(other.candidate.effect.name)
    drop = 1.0 - best.fit.heldout_rms_lsb / evidence.fit.heldout_rms_lsb
    place = next(p for c, p in zip(evidence.shapes, evidence.places, strict=True) if c is best.candidate)
    name = best.candidate.effect.name
    return Found(name, best.fit, best.gain, best.fall, p_value(evidence, place), drop, tuple(rivals))


def recheck(before: Fit, found: list[Found], white: Whitening, extra: Sequence[Effect] = ()) -> list[Found]:
    """With all effects in: is each still needed, and would one of its rivals do as well in its place?"""
    if len(found) < 2:
        return found
    kept, last = list(found), found[-1].fit
    total = whitened_rss(last, white, extra)[0]
    count, names = float(last.gram.count), {f.effect for f in found}
    for one in found:
        without = {k: v for k, v in last.setups.items() if k != one.effect}
        rss = whitened_rss(refit(last, without, {}), white, extra)[0]
        lost = int(last.free.sum()) - sum(len(t.params) for t in last.model.terms if t.effect.name != one.effect)
        if bic_gain(rss, rss - total, max(lost, 1), count) < ENOUGH and one.effect != kept[-1].effect:
            kept.remove(one)
    return [replace(f, rivals=tuple(r for r in f.rivals if r not in names)) for f in kept]
