"""Which recording to make next, by what it would add.

A recording adds its Gram matrix to the log's. What is left of an effect once the model's own columns (and a rival's)
are taken off, in standard errors, says how well it shows or how well two part; the recording that leaves most of it
is proposed. Noise is taken for white here.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from barberpole.chain import full
from barberpole.diagnose.columns import Candidate, again
from barberpole.diagnose.evidence import Evidence
from barberpole.diagnose.ground import Ground, ground_of
from barberpole.diagnose.patterns import Pattern
from barberpole.diagnose.recordings import ROWS, Recording, observed, ordinary, recordings
from barberpole.diagnose.table import Design, multiply, parts_of
from barberpole.effects import Effect
from barberpole.errors import InputError
from barberpole.numbers import plain

REST = "record the sensor at rest for 60 s and pass it with --noise"
PARTED = 5.0  # standard errors that tell two effects apart, or show one
RANK = 1e-9  # squared sine of the angle between columns below which they are one
MUST_GAIN = 1.5  # a recording that adds less than this factor is not worth the while


Outlook = tuple[Recording, list[float]]
"""A recording and, for each question, what is left in standard errors."""


@dataclass(frozen=True)
class Question:
    """What a log leaves open: does `wanted` show beside the model and `rivals`? size: of its columns' weights."""

    wanted: Candidate
    rivals: tuple[Candidate, ...]
    size: np.ndarray


def next_experiment(
    first: Evidence,
    verdict: str,
    groups: Sequence[tuple[str, ...]],
    blind: Sequence[str],
    remains: Sequence[Pattern],
    extra: Sequence[Effect] = (),
) -> str:
    """What the suspects leave, and the recording that settles a group or makes an invisible effect visible."""
    found = []
    if remains:
        found.append(
            f"the suspects leave structure: {remains[0].axis} against {remains[0].against}, {remains[0].shape}"
        )
    elif verdict == "unexplained":
        found.append("no effect in the catalogue explains what is left: the patterns say against what it varies")
    if groups:
        found.append(settling(first, groups[0], extra))
    elif not found and blind:
        found.append(showing(first, blind, extra))
    return "; ".join(found)


def settling(first: Evidence, group: tuple[str, ...], extra: Sequence[Effect] = ()) -> str:
    """How to tell the first of a group from those others that any recording tells it from."""
    questions = {rival: q for rival in group[1:] if (q := _between(first, group[0], rival))}
    now = {rival: _sigmas(_log_gram(first, q), q) for rival, q in questions.items()}
    table = _outlooks(first, list(questions.values()), extra)
    settled = []
    for at, rival in enumerate(questions):
        most = max((sigmas[at] for _, sigmas in table), default=0.0)
        if most > max(MUST_GAIN * now[rival], 1.0):
            settled.append((at, rival))
    if not settled:
        return f"this log cannot tell {group[0]} from {', '.join(group[1:])}, nor can any recording considered"
    recording, sigmas = max(table, key=lambda row: min(row[1][at] for at, _ in settled))
    names, least = ", ".join(rival for _, rival in settled), min(sigmas[at] for at, _ in settled)
    before = min(now[rival] for _, rival in settled)
    gain = f"{ROWS} samples part them by {plain(least, 2)} standard errors, this log by {_sure(before)}"
    return f"to tell {group[0]} from {names}: {recording.words} ({gain})"


def showing(first: Evidence, blind: Sequence[str], extra: Sequence[Effect] = ()) -> str:
    """How to see the first effect that a recording can show; else why there is none."""
    excuse = ""
    for name in blind:
        question = _alone(first, name)
        if question is None:
            continue
        now, table = _sigmas(_log_gram(first, question), question), _outlooks(first, [question], extra)
        recording, sigmas = max(table, key=lambda row: row[1][0])
        most = sigmas[0]
        if most > max(PARTED, MUST_GAIN * now):
            return f"this log cannot show {name}: {recording.words} ({_gain(now, most)})"
        same = " and ".join(_absorbing(first, question))
        if same and not excuse:
            excuse = f"this log cannot show {name}: it is indistinguishable from {same}, which the model already has"
    return excuse


def _gain(now: float, most: float) -> str:
    if now > PARTED:  # clear of the noise, but too small a part of it to go by
        return f"{ROWS} samples show it {plain(most / now, 2)} times as clearly"
    return f"{ROWS} samples show its typical size at {plain(most, 2)} standard errors, this log at {_sure(now)}"


def _sure(sigmas: float) -> str:
    """Standard errors; of less than a hundredth nobody wants to know."""
    return plain(sigmas, 2) if sigmas >= 0.01 else "none"


def _between(first: Evidence, name: str, rival: str) -> Question | None:
    """One of a group against another, as large as this log shows it."""
    one, other = _form(first, name), _form(first, rival)
    if one is None or other is None:
        return None
    weights = first.projection.weights(first.places[one])[0]
    return Question(first.candidates[one], (first.candidates[other],), weights)


def _alone(first: Evidence, name: str) -> Question | None:
    """An effect of its typical size."""
    at = _form(first, name)
    return None if at is None else Question(first.candidates[at], (), np.abs(first.candidates[at].typical))


def _form(first: Evidence, name: str) -> int | None:
    """The form of an effect that fits this log best."""
    places = [at for at, form in enumerate(first.candidates) if form.effect.name == name]
    return max(places, key=lambda at: first.gain(first.places[at]), default=None)


def _outlooks(first: Evidence, questions: Sequence[Question], extra: Sequence[Effect]) -> list[Outlook]:
    """Each recording that can be made, with how well the log and it together answer each question."""
    found, known = [], [_log_gram(first, q) for q in questions]
    for recording in recordings(first.fit):
        try:
            ground = _ground(first, recording, extra)
            added = [_new_gram(first, ground, q) for q in questions]
        except InputError:  # a field beyond what the fitted model can invert
            continue
        both = zip(known, added, questions, strict=True)
        found.append((recording, [_sigmas(_sum(old, new), q) for old, new, q in both]))
    return found


def _ground(first: Evidence, recording: Recording, extra: Sequence[Effect]) -> Ground:
    fit = first.fit
    seen = observed(fit, recording.change(ordinary(fit)))
    return ground_of(replace(fit, problem=replace(fit.problem, seen=seen, believed=None)), extra)


def _log_gram(first: Evidence, question: Question) -> np.ndarray:
    """Gram of [model, rivals, wanted] in this log, over the noise."""
    where = {id(form): places for form, places in zip(first.candidates, first.places, strict=True)}
    picked = [first.baseline, *(where[id(r)] for r in question.rivals), where[id(question.wanted)]]
    columns = np.concatenate(picked)
    return first.table.total[np.ix_(columns, columns)]


def _new_gram(first: Evidence, ground: Ground, question: Question) -> np.ndarray:
    """The same in a recording. Known vectors bring in three rotations, which a magnitude does not see."""
    design = Design(len(ground.residual))
    turns = ground.normal is None and first.ground.normal is not None
    if turns:
        design.add(parts_of(_rotations(ground)), 3)
    base = ground.baseline()
    design.add(parts_of(base), base.shape[1])
    for form in (*question.rivals, question.wanted):
        columns = again(form, ground)
        design.add(columns.parts, len(columns.names))
    return multiply(design).table().total / float(np.mean(first.white.noise.white))


def _rotations(ground: Ground) -> np.ndarray:
    """(3, 3, n): what turning the true field about each axis does to the readings."""
    fit = ground.fit
    slope = fit.model.linearise(ground.field, fit.p, fit.problem.seen.at, field_too=True)[2]
    turned = np.stack([np.cross(axis, ground.field, axisb=0, axisc=0) for axis in np.eye(3)], axis=1)
    return np.einsum("ijn,jkn->ikn", full(np.asarray(slope), ground.field.shape[1]), turned)


def _sum(old: np.ndarray, new: np.ndarray) -> np.ndarray:
    """Two Gram matrices; what only the new one has comes first in it."""
    more = len(new) - len(old)
    out = new.copy()
    out[more:, more:] += old
    return out


def _sigmas(gram: np.ndarray, question: Question) -> float:
    """What is left of the wanted effect beside all columns before it, in standard errors."""
    own = question.size.size
    rest, at = gram[:-own, :-own], np.arange(len(gram) - own, len(gram))
    size = np.sqrt(np.maximum(np.diag(rest), 1e-300))
    inverse = np.linalg.pinv(rest / np.outer(size, size), rcond=RANK, hermitian=True)
    cross = gram[:-own][:, at] @ question.size / size
    whole = float(question.size @ gram[np.ix_(at, at)] @ question.size)
    left = whole - float(cross @ inverse @ cross)
    return float(np.sqrt(max(left, 0.0))) if left > RANK * whole else 0.0


def _absorbing(first: Evidence, question: Question) -> list[str]:
    """Effects of the model that together take all of an invisible effect."""
    gram = _log_gram(first, question)
    names = [n.split(".")[0] for n, free in zip(first.fit.model.names, first.fit.free, strict=True) if free]
    kept = list(dict.fromkeys(names))
    own = np.arange(len(names), len(gram))
    limit = max(2.0 * _sigmas(gram, question), 1.0)
    for name in tuple(kept):
        others = np.array([n in kept and n != name for n in names])
        trial = np.concatenate([np.flatnonzero(others), own])
        if _sigmas(gram[np.ix_(trial, trial)], question) <= limit:
            kept.remove(name)
    return kept
