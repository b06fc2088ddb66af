"""Finding the missing effects one after another: score at the null, exact refit of the best, rivals side by side."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from barberpole.diagnose.candidates import Absent
from barberpole.diagnose.columns import Candidate
from barberpole.diagnose.evidence import Evidence, bic_gain, examine, whitened_rss
from barberpole.diagnose.table import heldout, project
from barberpole.diagnose.tails import LIKELIER, LIKELIER_COLOURED, lonely_giants, wrong_readings
from barberpole.diagnose.whitening import Whitening
from barberpole.effects import Effect
from barberpole.errors import InputError
from barberpole.fit.fit import Fit, believable, refit, setup_of
from barberpole.fit.start import start_values

ENOUGH = 10.0  # gain in BIC that a name needs
REFITTED = 3  # candidates refitted exactly each round
IN_REACH = 0.5  # of the best linear gain: below it a refit cannot win
ALIKE = 0.8  # correlation of what an effect explains with what another can: above, they are confusable
NEARLY = 0.9  # of the best gain: a rival whose held-out error is not clearly worse is not excluded
WORSE = 1.03  # held-out error over the one before, more than coloured noise alone makes of a true effect
MOST = 5  # effects added before giving up


@dataclass(frozen=True)
class Found:
    """An effect put in: the fit with it, how much it takes off the whitened sum of squares, its p-value, rivals that
    this log cannot tell from it."""

    effect: str
    fit: Fit
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


def search(evidence: Evidence, absent: Absent, extra: Sequence[Effect] = ()) -> tuple[list[Found], Evidence]:
    """Effects in the order found, and the evidence at the end."""
    found: list[Found] = []
    while len(found) < MOST:
        best = best_addition(evidence, extra) or doubtful_readings(evidence, absent)
        if best is None:
            break
        found.append(best)
        evidence = examine(best.fit, absent, evidence.white, extra)
    return found, evidence


def best_addition(evidence: Evidence, extra: Sequence[Effect]) -> Found | None:
    """The effect that gains most by exact refit, if any gains enough."""
    ranked = promising(evidence)
    tried = [at for gain, at in ranked if gain >= IN_REACH * ranked[0][0]]
    trials = [attempt(evidence, at, extra) for at in tried]
    forms = forms_tried(evidence)
    worth = [t for t in trials if t and t.gain > ENOUGH]
    worth.sort(key=lambda t: 2.0 * np.log(forms[t.candidate.effect.name]) - t.gain)
    if not worth:
        return None
    others = [attempt(evidence, at, extra) for at in alike(evidence, worth[0], tried)]
    return _found(evidence, worth + [t for t in others if t])


def alike(evidence: Evidence, best: Trial, tried: Sequence[int]) -> list[int]:
    """Forms of effects not tried yet that could pass for the best: what it explains, they explain nearly as well."""
    done = {evidence.candidates[at].effect.name for at in tried}
    signal = evidence.places[next(i for i, c in enumerate(evidence.candidates) if c is best.candidate)]
    close: dict[str, tuple[float, int]] = {}
    for at, shape in enumerate(evidence.candidates):
        likeness = 0.0 if shape.effect.name in done else evidence.projection.likeness(signal, evidence.places[at])
        if likeness > max(ALIKE, close.get(shape.effect.name, (0.0, 0))[0]):
            close[shape.effect.name] = (likeness, at)
    return [at for _, at in sorted(close.values(), reverse=True)[:REFITTED]]


def attempt(evidence: Evidence, at: int, extra: Sequence[Effect]) -> Trial | None:
    """Refit with a candidate; None where that fails."""
    try:
        after = _refitted(evidence, at)
    except InputError:  # its start lies beyond what can be inverted
        return None
    table, baseline = whitened_rss(after, evidence.white, extra)
    rss = project(table, baseline).rss
    rank = int(after.free.sum() - evidence.fit.free.sum())
    fall = evidence.projection.rss - rss
    folds = heldout(table, baseline)
    if folds.sum() >= heldout(evidence.table, evidence.baseline).sum():
        return None  # what it takes off does not carry over to stretches it has not seen
    if after.heldout_rms_lsb > WORSE * evidence.fit.heldout_rms_lsb:
        return None  # nor is it a cause if those stretches fit worse than they did, whatever the noise model says
    gain = bic_gain(evidence.projection.rss, fall, rank, evidence.table.count, evidence.candidates[at].tried)
    return Trial(evidence.candidates[at], after, gain, fall, folds)


def doubtful_readings(evidence: Evidence, absent: Absent) -> Found | None:
    """The effect that weighs single wrong readings down, if there are any and the model lacks it."""
    effect = _loss(evidence.fit, absent)
    if effect is None:
        return None
    residual = evidence.ground.residual
    gain = wrong_readings(residual, bool(evidence.white.filter))
    if gain <= (LIKELIER_COLOURED if evidence.white.filter else LIKELIER):
        return None
    after = _weighed(evidence.fit, effect, absent, {})
    left = np.sum((residual * believable(residual)) ** 2) / np.sum(residual**2)
    fall = evidence.projection.rss * float(1.0 - left)
    drop = 1.0 - after.heldout_rms_lsb / evidence.fit.heldout_rms_lsb
    return Found(effect.name, after, fall, float(max(np.exp(-gain), 1e-300)), drop)


def giant_readings(fit: Fit, absent: Absent) -> Found | None:
    """The same where readings are so wrong that they lead the fit astray: judged from its closed-form start."""
    effect = _loss(fit, absent)
    start = start_values(fit.model, fit.linear)
    residual = fit.problem.residual(start)
    gain = lonely_giants(residual)
    if effect is None or gain <= LIKELIER_COLOURED:
        return None
    after = _weighed(fit, effect, absent, dict(zip(fit.model.names, start.tolist(), strict=True)))
    drop = 1.0 - after.heldout_rms_lsb / fit.heldout_rms_lsb
    fall = float(np.sum(fit.problem.residual(fit.p) ** 2) / after.rms_lsb**2 - residual.size)
    return Found(effect.name, after, max(fall, 0.0), float(max(np.exp(-gain), 1e-300)), drop)


def _loss(fit: Fit, absent: Absent) -> Effect | None:
    """The effect that weighs residuals, if the model lacks it."""
    return next((e for e in absent.effects if e.loss and e.name not in fit.model.effects), None)


def _weighed(fit: Fit, effect: Effect, absent: Absent, start: dict[str, float]) -> Fit:
    setup = setup_of(fit.problem.seen, fit.linear, absent.settings.get(effect.name))
    return refit(fit, fit.setups | {effect.name: setup}, start)


def forms_tried(evidence: Evidence) -> dict[str, int]:
    """How many alternatives were looked through for each effect."""
    forms: dict[str, int] = {}
    for shape in evidence.candidates:
        forms[shape.effect.name] = forms.get(shape.effect.name, 0) + shape.tried
    return forms


def promising(evidence: Evidence) -> list[tuple[float, int]]:
    """(linear gain, shape) of the best effects, one shape each."""
    forms = forms_tried(evidence)
    best: dict[str, tuple[float, int]] = {}
    for at, shape in enumerate(evidence.candidates):
        gain = evidence.gain(evidence.places[at], forms[shape.effect.name])
        if gain > max(ENOUGH, best.get(shape.effect.name, (0.0, 0))[0]):
            best[shape.effect.name] = (gain, at)
    return sorted(best.values(), reverse=True)[:REFITTED]


def linear_drop(evidence: Evidence) -> float:
    """Fall of the RMS that the best candidate promises; 0 if none is promising."""
    shares = [evidence.projection.score(evidence.places[at])[0] for _, at in promising(evidence)]
    return float(1.0 - np.sqrt(max(1.0 - max(shares, default=0.0) / evidence.projection.rss, 0.0)))


def _refitted(evidence: Evidence, at: int) -> Fit:
    """The exact fit with this form, begun where the linear answer points if the form is linear."""
    shape = evidence.candidates[at]
    name = shape.effect.name
    start = {f"{name}.{key}": value for key, value in shape.start.items()}
    if shape.linear:
        weights = evidence.projection.weights(evidence.places[at])[0]
        weights = np.where(shape.even, np.sqrt(np.abs(weights * shape.typical)), weights)
        start |= {f"{name}.{key}": float(w) for key, w in zip(shape.names, weights, strict=True)}
    hold = frozenset(f"{name}.{key}" for key in shape.held)
    return refit(evidence.fit, evidence.fit.setups | {name: shape.setup}, start, hold)


def _found(evidence: Evidence, trials: list[Trial]) -> Found:
    best, rivals = trials[0], []
    for other in trials[1:]:
        apart = other.folds - best.folds
        unsure = apart.sum() < 2.0 * np.sqrt(len(apart)) * np.std(apart, ddof=1)
        # a rival that takes off as much with more parameters is not excluded by having them
        as_good = best.gain - other.gain < ENOUGH or best.fall - other.fall < ENOUGH
        if as_good or (unsure and other.gain > NEARLY * best.gain):
            rivals.append(other.candidate.effect.name)
    drop = 1.0 - best.fit.heldout_rms_lsb / evidence.fit.heldout_rms_lsb
    place = next(p for c, p in zip(evidence.candidates, evidence.places, strict=True) if c is best.candidate)
    name = best.candidate.effect.name
    return Found(name, best.fit, best.fall, evidence.p_value(place), drop, tuple(rivals))


def recheck(found: list[Found], white: Whitening, extra: Sequence[Effect] = ()) -> list[Found]:
    """With all effects in: is each still needed, and would one of its rivals do as well in its place?"""
    if len(found) < 2:
        return found
    kept, last = list(found), found[-1].fit
    total = project(*whitened_rss(last, white, extra)).rss
    count, names = float(last.gram.count), {f.effect for f in found}
    for one in found:
        without = {k: v for k, v in last.setups.items() if k != one.effect}
        fit = refit(last, without, {})
        rss = project(*whitened_rss(fit, white, extra)).rss
        lost = int(last.free.sum()) - int(fit.free.sum())
        if bic_gain(rss, rss - total, max(lost, 1), count) < ENOUGH and one.effect != kept[-1].effect:
            kept.remove(one)
    return [replace(f, rivals=tuple(r for r in f.rivals if r not in names)) for f in kept]
