"""Which effect is missing from a model, as far as this log can tell."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from barberpole.diagnose.candidates import Absent, absent_effects, candidates
from barberpole.diagnose.columns import Ground, ground_of
from barberpole.diagnose.experiments import next_experiment
from barberpole.diagnose.noise import Noise, estimate
from barberpole.diagnose.patterns import Pattern, Survey, patterns, survey
from barberpole.diagnose.search import Evidence, Found, bic_gain, search
from barberpole.diagnose.turning import AnyNoise, turning_noise
from barberpole.effects import Effect
from barberpole.errors import InputError
from barberpole.fit.fit import Fit, fit_observations
from barberpole.log import Log
from barberpole.modelfile import ModelFile
from barberpole.observations import Observations, observations
from barberpole.sensor import Sensor

GEOMETRY = 30.0  # condition number of the linear part above which nothing is named (full turns: below 6)
BLIND = 0.05  # of an effect's RMS left by the baseline: below it this log cannot see the effect
COVERED = 0.8  # of what can be explained at all must a catalogue effect explain
SLOWEST = 8  # periods a record: below this the residual has lost power to the fit
ENOUGH = 10.0  # gain in BIC before anything counts as left over
LINEAR = ("bias", "scale", "misalignment")


@dataclass(frozen=True)
class Suspect:
    """An effect that explains the excess. rms_after_lsb: with it and those before it put in."""

    effect: str
    p_value: float
    rms_after_lsb: float
    heldout_drop: float
    confounded_with: tuple[str, ...]


@dataclass(frozen=True)
class Diagnosis:
    """The answer; `to_json` is the object of `diagnose --json`. fits: the model given, then with each suspect."""

    verdict: str
    n: int
    noise_lsb: float
    rms_lsb: float
    suspects: tuple[Suspect, ...]
    patterns: tuple[Pattern, ...]
    cannot_be_seen: tuple[str, ...]
    cannot_be_judged: dict[str, str]
    next_experiment: str
    visibility: dict[str, float] = field(default_factory=dict)
    fits: tuple[Fit, ...] = field(default=(), repr=False)

    def to_json(self) -> dict[str, Any]:
        """Plain numbers, strings, lists and dictionaries."""
        shown = {k: v for k, v in vars(self).items() if k not in ("fits", "visibility")}
        shown["suspects"] = [asdict(s) | {"confounded_with": list(s.confounded_with)} for s in self.suspects]
        shown["patterns"] = [asdict(p) for p in self.patterns]
        return shown | {"cannot_be_seen": list(self.cannot_be_seen)}


def diagnose(
    log: Log,
    file: ModelFile,
    noise_log: Log | None = None,
    sensor: Sensor | None = None,
    extra: Sequence[Effect] = (),
) -> Diagnosis:
    """Judge a model on a log. Raises InputError where the log cannot be fitted for want of columns or rows."""
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
    try:
        fit = fit_observations(_about_its_temperature(seen), file, extra)
    except InputError as error:
        return _inconclusive(seen, str(error))
    absent = absent_effects(fit, extra, file.settings, state_known)
    lack = _geometry(fit)
    if lack:
        return _inconclusive(seen, lack, fit, absent)
    noise = _noise(fit, absent, rest, extra)
    found, evidence = search(fit, absent, noise, extra)
    return _conclude(fit, absent, noise, found, evidence, extra)


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


def _noise(fit: Fit, absent: Absent, rest: Observations | None, extra: Sequence[Effect]) -> AnyNoise:
    """From a record at rest, else from what no effect and no covariate explains."""
    ground = ground_of(fit, extra)
    if rest is None:
        left = _unexplained_residual(ground, [c.columns for c in candidates(ground, absent)])
        noise = estimate(left, "residual", SLOWEST, ground.normal)
    else:
        noise = estimate(rest.y, "rest")
    if ground.normal is None:
        return noise
    return turning_noise(noise, ground.normal) if noise.coloured else noise.common()


def _unexplained_residual(ground: Ground, known: list[np.ndarray]) -> np.ndarray:
    """Residual (m, n) less everything that any effect or covariate can take."""
    white = Noise(np.full(ground.residual.shape[0], float(np.mean(ground.residual**2)) or 1.0))
    seen = survey(ground, white, known)
    return seen.left_over()


def _conclude(fit, absent, noise, found: list[Found], evidence: Evidence, extra) -> Diagnosis:
    last = found[-1].fit if found else fit
    left = survey(evidence.ground, noise)
    covered, leftover = _coverage(found, left)
    verdict = _verdict(found, covered, leftover)
    first = left if not found else survey(ground_of(fit, extra), noise)
    names = _visibility(evidence)
    blind = tuple(n for n, v in names.items() if v < BLIND)
    groups = [(f.effect, *f.rivals) for f in found if f.rivals]
    return Diagnosis(
        verdict,
        fit.problem.n,
        noise.rms(fit.problem.n),
        fit.rms_lsb,
        tuple(map(_suspect, found)),
        tuple(patterns(left if verdict == "unexplained" else first)),
        blind,
        absent.unjudged,
        next_experiment(verdict, groups, blind),
        names,
        (fit, *(f.fit for f in found)) if last is not fit else (fit,),
    )


def _coverage(found: list[Found], left: Survey) -> tuple[float, bool]:
    """Part of all that can be explained that the effects found explain; whether what is left is significant."""
    score, rank = left.projection.score(left.everything)
    gain = max(
        (
            bic_gain(left.projection.rss, *left.projection.score(columns), left.table.count)
            for _, _, columns in left.places
        ),
        default=0.0,
    )
    taken = sum(f.gain for f in found)
    excess = max(score - rank, 0.0)
    return taken / max(taken + excess, 1e-300), gain > ENOUGH + 2 * np.log(len(left.places))


def _verdict(found: list[Found], covered: float, leftover: bool) -> str:
    if not found:
        return "unexplained" if leftover else "adequate"
    return "unexplained" if leftover and covered < COVERED else "missing"


def _visibility(evidence: Evidence) -> dict[str, float]:
    """Of each absent effect, the largest part of its RMS that survives the baseline."""
    out: dict[str, float] = {}
    for shape, columns in zip(evidence.shapes, evidence.places, strict=True):
        name = shape.effect.name
        out[name] = max(out.get(name, 0.0), evidence.projection.visibility(columns))
    return out


def _suspect(found: Found) -> Suspect:
    return Suspect(found.effect, found.p_value, found.fit.rms_lsb, found.heldout_drop, found.rivals)


def _inconclusive(seen: Observations, why: str, fit: Fit | None = None, absent: Absent | None = None) -> Diagnosis:
    rms = fit.rms_lsb if fit else float("nan")
    return Diagnosis(
        "inconclusive",
        seen.y.shape[1],
        float("nan"),
        rms,
        (),
        (),
        (),
        absent.unjudged if absent else {},
        why,
        fits=(fit,) if fit else (),
    )
