"""Which effect is missing from a model, as far as this log can tell."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from barberpole.diagnose.answer import Diagnosis, at_rest_answer, inconclusive, suspect
from barberpole.diagnose.candidates import Absent, absent_effects
from barberpole.diagnose.evidence import Evidence, examine, unsure_of_noise
from barberpole.diagnose.experiments import REST, next_experiment
from barberpole.diagnose.patterns import JUMPS, Pattern, jump_patterns, patterns
from barberpole.diagnose.resting import noise_of, noise_within
from barberpole.diagnose.search import Found, giant_readings, linear_drop, recheck, search
from barberpole.diagnose.still import still
from barberpole.diagnose.stretches import in_full, part_of
from barberpole.diagnose.visibility import unseen, visibility
from barberpole.diagnose.whitening import whitening
from barberpole.effects import Effect
from barberpole.errors import CoverageError
from barberpole.fit.answer import FEW
from barberpole.fit.easy_axes import with_easy_axes
from barberpole.fit.fit import Fit, fit_observations
from barberpole.fit.noise import Noise
from barberpole.log import Log
from barberpole.modelfile import ModelFile
from barberpole.observations import Observations, observations
from barberpole.sensor import Sensor

GEOMETRY = 30.0  # condition number of the linear part above which nothing is named (full turns: below 6)
COVERED = 0.8  # of what can be explained at all must a catalogue effect explain
ENOUGH = 10.0  # gain in BIC before anything counts as left over
CLEAR = 0.1  # fall of the held-out error that no noise makes
MAIN_CAUSE = 0.3  # of what can be explained: a suspect that leaves structure must take this much to be named
LINEAR = ("bias", "scale", "misalignment")


def diagnose(
    log: Log,
    file: ModelFile,
    noise_log: Log | None = None,
    sensor: Sensor | None = None,
    extra: Sequence[Effect] = (),
) -> Diagnosis:
    """Judge a model on a log. Raises InputError where the log is wrong, or lacks a column that the model needs; one
    that is only too short or too flat is inconclusive."""
    seen = observations(log, sensor)
    rest = None if noise_log is None else observations(noise_log, sensor)
    known = log.has("state") or bool(np.any(np.asarray(seen.at.state)))
    return diagnose_observations(seen, file, rest, extra, known)


def diagnose_observations(
    seen: Observations,
    file: ModelFile,
    rest: Observations | None = None,
    extra: Sequence[Effect] = (),
    state_known: bool = True,
) -> Diagnosis:
    """The same on observations."""
    at_rest = still(seen)
    if at_rest is not None:
        return at_rest_answer(seen, at_rest)
    seen = with_easy_axes(seen)
    try:
        fit = fit_observations(_about_its_temperature(seen), file, extra)
    except CoverageError as error:
        return inconclusive(seen, str(error))
    absent = absent_effects(fit, extra, file.settings, state_known)
    lack = _geometry(fit) or _too_few(fit)
    if lack:
        return inconclusive(seen, lack, fit, absent)
    part, how = part_of(fit), (fit, absent, rest, extra)
    said = _judge(examine(part, absent, None, extra), [], *how)
    giants = giant_readings(part, absent) if said.verdict == "inconclusive" else None
    return _judge(examine(giants.fit, absent, None, extra), [giants], *how) if giants else said


def _judge(
    first: Evidence, put_in: list[Found], fit: Fit, absent: Absent, rest: Observations | None, extra: Sequence[Effect]
) -> Diagnosis:
    """The answer from the evidence beside a model with the effects `put_in`."""
    seen = fit.problem.seen
    noise = first.background()
    first = _under(first, noise if rest is None else noise_of(rest, seen, noise))
    if unsure_of_noise(first) and (within := noise_within(seen)) is not None:
        first = _under(first, within)
    if unsure_of_noise(first) and 0.0 < linear_drop(first) < 0.5 * CLEAR:
        return _noise_unknown(first, absent, patterns(first))
    found, last = search(first, absent, extra)
    found = put_in + recheck(found, first.white, extra)
    return _conclude(fit, first, last, absent, found, extra)


def _under(evidence: Evidence, noise: Noise) -> Evidence:
    return evidence.under(whitening(noise, evidence.fit.problem.n, evidence.ground.normal))


def _about_its_temperature(seen: Observations) -> Observations:
    """The log's mean temperature as reference: drifts are then judged by how they vary, not by where they began."""
    if seen.at.temp_c is None:
        return seen
    return replace(seen, at=replace(seen.at, t0_c=float(np.mean(seen.at.temp_c))))


def _geometry(fit: Fit) -> str:
    """What the motion lacks to carry a model, or ''."""
    linear = np.array([name.split(".")[0] in LINEAR for name in fit.model.names])
    frozen = [n for n, lin, free in zip(fit.model.names, linear, fit.free, strict=True) if lin and not free]
    if frozen:
        return f"turn the sensor through all directions: this log does not determine {', '.join(frozen)}"
    condition = fit.condition_of(linear & fit.free)
    if condition > GEOMETRY:
        return (
            "turn the sensor through all directions, upside down as well: bias, scale and angles can hardly be told "
            f"apart in this log (condition number {condition:.0f}, at most {GEOMETRY:.0f} wanted)"
        )
    return ""


def _too_few(fit: Fit) -> str:
    """How many rows are missing for the residual to say anything, or ''."""
    rows, wanted = np.unique(fit.problem.seen.row).size, FEW * int(fit.free.sum())
    readings = fit.problem.n * fit.problem.residuals_per_sample
    if readings >= wanted:
        return ""
    least = -(-wanted * rows // readings)
    return f"record at least {least} rows: {rows} say too little of {int(fit.free.sum())} parameters and their noise"


def _conclude(
    fit: Fit, first: Evidence, last: Evidence, absent: Absent, found: list[Found], extra: Sequence[Effect]
) -> Diagnosis:
    """The verdict from the evidence beside the model given and beside it with all effects found."""
    remains = _remains(last)
    jumping = any(p.shape == JUMPS for p in remains)
    settled = any(f.heldout_drop > CLEAR for f in found) if jumping else _covered(found, last) >= COVERED
    verdict = _verdict(found, settled, bool(remains))
    if verdict != "adequate" and unsure_of_noise(first) and not any(f.heldout_drop > CLEAR for f in found):
        return _noise_unknown(first, absent, patterns(first))
    if verdict == "unexplained":
        found = [f for f in found if f.fall > MAIN_CAUSE * _explainable(found, last)]
    visible = visibility(last, absent)
    rivals = {name for f in found for name in f.rivals}
    blind = tuple(name for name in unseen(visible) if name not in rivals)
    groups = [(f.effect, *f.rivals) for f in found if f.rivals]
    found, white = in_full(fit, found), first.white
    return Diagnosis(
        verdict=verdict,
        n=fit.problem.n,
        noise_lsb=white.noise.rms(fit.problem.n),
        rms_lsb=fit.rms_lsb,
        suspects=tuple(map(suspect, found)),
        patterns=tuple(remains if verdict == "unexplained" else patterns(first)),
        cannot_be_seen=blind,
        cannot_be_judged=absent.unjudged,
        next_experiment=next_experiment(first, verdict, groups, blind, remains if found else [], extra),
        visibility=visible,
        fits=(fit, *(f.fit for f in found)),
    )


def _noise_unknown(first: Evidence, absent: Absent, shown: list[Pattern]) -> Diagnosis:
    fit, noise = first.fit, first.white.noise
    visible = visibility(first, absent)
    return Diagnosis(
        "inconclusive",
        fit.problem.n,
        noise.rms(fit.problem.n),
        fit.rms_lsb,
        (),
        tuple(shown),
        unseen(visible),
        absent.unjudged,
        f"the residual is correlated in time, and nothing says how much of that is the sensor's noise: {REST}",
        visible,
        (fit,),
    )


def _remains(left: Evidence) -> list[Pattern]:
    """What is significant in a residual: dependence on a covariate by its gain in BIC, and jumps."""
    gain = max((left.gain(columns) for _, _, columns in left.covariates), default=0.0)
    found = patterns(left) if gain > ENOUGH + 2 * np.log(len(left.covariates)) else []
    return sorted(found + jump_patterns(left), key=lambda pattern: pattern.p_value)


def _explainable(found: list[Found], left: Evidence) -> float:
    """Whitened sum of squares that effects found and covariates together take."""
    score, rank = left.projection.score(left.all_covariates)
    return sum(f.fall for f in found) + max(score - rank, 0.0)


def _covered(found: list[Found], left: Evidence) -> float:
    """Part of all that can be explained that the effects found explain."""
    return sum(f.fall for f in found) / max(_explainable(found, left), 1e-300)


def _verdict(found: list[Found], settled: bool, leftover: bool) -> str:
    """settled: whether what was found explains most of what can be, jumps aside."""
    if not found:
        return "unexplained" if leftover else "adequate"
    return "unexplained" if leftover and not settled else "missing"
