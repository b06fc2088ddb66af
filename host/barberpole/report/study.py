"""Everything a report says of one log: fit, comparison, diagnosis, change against the factory, self-calibration.

The numbers are gathered here once; `answer` is the object that --json prints and that the page carries.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from barberpole.calibrating import calibration_of
from barberpole.calibration import Calibration, Value
from barberpole.diagnose import Comparison, Diagnosis, compare, diagnose
from barberpole.diagnose.answer import inconclusive
from barberpole.diagnose.resting import noise_of
from barberpole.effects import Effect, find_effect
from barberpole.errors import InputError
from barberpole.figures.parameters import change_sigma
from barberpole.figures.waterfall import Stage, stages_of_diagnosis, stages_of_history
from barberpole.fit.answer import fit_json
from barberpole.fit.fit import Fit, fit_observations
from barberpole.fit.noise import Noise
from barberpole.fitted import from_calibration
from barberpole.log import Log
from barberpole.modelfile import ModelFile
from barberpole.numbers import strict
from barberpole.observations import Observations, observations
from barberpole.selfcal import SelfcalResult, recompute
from barberpole.sensor import Sensor
from barberpole.summary import Summary, summarise
from barberpole.verify import Verification, coils_driven, factory_response, verify

FIRST = ("bias", "scale")  # what no sensor does without: the first model on the path


@dataclass(frozen=True, eq=False)
class Given:
    """What the command line gives beside the log: model, calibration to hold it against, noise at rest, sensor."""

    file: ModelFile
    calibration: Calibration | None = None
    rest: Log | None = None
    sensor: Sensor | None = None
    extra: tuple[Effect, ...] = ()


@dataclass(frozen=True, eq=False)
class Study:
    """One log, studied. Where the log cannot carry a fit, `fit` and `comparison` are None and the diagnosis says why;
    where it holds a coil run alone, so is the diagnosis.

    path: models on the way, with the error of each; values, factory: parameters now and then; check: the log against
    the calibration as it stands, refused: why that cannot be; coil: the run computed again on the host.
    """

    log: Log
    summary: Summary
    given: Given
    fit: Fit | None = None
    comparison: Comparison | None = None
    diagnosis: Diagnosis | None = None
    path: tuple[Stage, ...] = ()
    values: dict[str, Value] = field(default_factory=dict)
    check: Verification | None = None
    refused: str = ""
    coil: SelfcalResult | None = None

    @property
    def noise_lsb(self) -> float:
        """Of the diagnosis, or of the comparison where it has none."""
        if self.diagnosis and np.isfinite(self.diagnosis.noise_lsb):
            return self.diagnosis.noise_lsb
        return self.comparison.noise_lsb if self.comparison else float("nan")

    @property
    def factory(self) -> dict[str, Value]:
        """Parameters of the calibration given that the fit has too."""
        then = self.given.calibration.parameters if self.given.calibration else {}
        return {name: then[name] for name in self.values if name in then}

    @property
    def verdict(self) -> str:
        """The diagnosis' word; of a coil run alone: accepted or refused."""
        if self.diagnosis:
            return self.diagnosis.verdict
        result = self.log.meta.get("result")
        return "inconclusive" if result is None else "accepted" if result.get("accepted") else "refused"


def study(log: Log, given: Given) -> Study:
    """Study one log. Raises InputError where the model names an effect that there is not."""
    for name in given.file.effects:
        find_effect(name, given.extra)
    done = Study(log, summarise(log, given.sensor), given)
    done = replace(done, coil=_coil(log, given), **_checked(log, given))
    if coils_driven(log) and not log.has("t_s"):
        return done  # the points of the coil run alone: the coils' field is not one to fit to
    given = replace(given, file=_at_reference(given))
    found = _diagnosed(log, given)
    done = replace(done, given=given, diagnosis=found)
    if not found.fits:
        return done
    seen = observations(log, given.sensor)
    fit = fit_observations(seen, given.file, given.extra)
    noise = None if given.rest is None else _noise(observations(given.rest, given.sensor), seen, fit)
    path = _path(seen, given, found, fit)
    values = calibration_of(fit, log, given.file).parameters
    return replace(done, fit=fit, comparison=compare(fit, noise, given.extra), path=path, values=values)


def _diagnosed(log: Log, given: Given) -> Diagnosis:
    """The diagnosis; of a log that nothing can be fitted to, why, so that the page can say it."""
    try:
        return diagnose(log, given.file, given.rest, given.sensor, given.extra)
    except InputError as error:
        return inconclusive(observations(log, given.sensor), str(error))


def _at_reference(given: Given) -> ModelFile:
    """The model at the calibration's reference temperature, so that parameters can be compared."""
    if given.calibration is None or "temp_c" in given.file.reference:
        return given.file
    return replace(given.file, reference=given.file.reference | {"temp_c": given.calibration.t0_c})


def _noise(rest: Observations, seen: Observations, fit: Fit) -> Noise:
    level = Noise(np.full(fit.problem.residuals_per_sample, fit.rms_lsb**2))
    found = noise_of(rest, seen, level)
    return found if fit.problem.vector else found.common()


def _path(seen: Observations, given: Given, found: Diagnosis, fit: Fit) -> tuple[Stage, ...]:
    """The calibration's history where it is of this model; else the model's effects one after the other. Then the
    suspects."""
    suspects = stages_of_diagnosis(found)[1:]
    last = Stage("model", fit.heldout_rms_lsb, fit.rms_lsb)
    history = given.calibration.history if given.calibration else ()
    if len(history) > 1 and given.calibration and given.calibration.model.effects == given.file.effects:
        return (*stages_of_history(history), *suspects)
    steps = [name for name in given.file.effects if name not in FIRST]
    stages = []
    for count in range(len(steps)):
        effects = tuple(name for name in given.file.effects if name in FIRST or name in steps[:count])
        try:
            less = fit_observations(seen, replace(given.file, effects=effects), given.extra) if effects else None
        except InputError:
            continue
        if less:
            stages.append(Stage(f"+ {steps[count - 1]}" if count else ", ".join(effects), *_errors(less)))
    if stages:
        last = replace(last, name=f"+ {steps[-1]}")
    return (*stages, last, *suspects)


def _errors(fit: Fit) -> tuple[float, float]:
    return fit.heldout_rms_lsb, fit.rms_lsb


def _checked(log: Log, given: Given) -> dict[str, Any]:
    if given.calibration is None:
        return {}
    try:
        return {"check": verify(log, given.calibration)}
    except InputError as error:
        return {"refused": str(error)}


def _coil(log: Log, given: Given) -> SelfcalResult | None:
    """The coil run in double precision; None without one, or without a factory reference to hold it against."""
    reference = given.calibration.selfcal if given.calibration else None
    if log.selfcal is None or reference is None or given.calibration is None:
        return None
    return recompute(log.selfcal, from_calibration(given.calibration), factory_response(log.selfcal, reference))


def answer(study: Study) -> dict[str, Any]:
    """The object of one log."""
    found = study.given.calibration
    return {
        "log": str(study.log.path),
        "sha256": study.log.sha256,
        "verdict": study.verdict,
        "model": list(study.given.file.effects),
        "summary": study.summary.to_json(),
        "fit": fit_json(study.fit, study.log.skipped) if study.fit else None,
        "comparison": study.comparison.to_json() if study.comparison else None,
        "diagnosis": study.diagnosis.to_json() if study.diagnosis else None,
        "noise_lsb": study.noise_lsb,
        "path": [vars(stage) for stage in study.path],
        "calibration": found.hash if found else None,
        "factory": {name: _change(study.values[name], then) for name, then in study.factory.items()},
        "verify": study.check.to_json() if study.check else None,
        "refused": study.refused or None,
        "selfcal": _selfcal(study),
    }


def _change(now: Value, then: Value) -> dict[str, Any]:
    sigma = change_sigma(now, then)
    return {"value": then.value, "stderr": then.stderr, "change": now.value - then.value, "sigma": sigma}


def _selfcal(study: Study) -> dict[str, Any] | None:
    """The board's own verdict, and what the host makes of the same points."""
    run, coil = study.log.selfcal, study.coil
    if run is None:
        return None
    result = run.result or study.log.meta.get("result") or {}
    kept = ("accepted", "reasons", "gain", "residual_ut", "duration_s", "in_force")
    host = None
    if coil is not None:
        host = {"gain": coil.gain.tolist(), "residual_ut": coil.residual_ut.tolist(), "step_ut": coil.step_ut}
    return {"points": run.unit.shape[1], "temp_c": float(np.mean(run.temp_c)), "host": host} | {
        f"board_{key}": result.get(key) for key in kept
    }


def answers(studies: Sequence[Study], command: str, versions: dict[str, str]) -> dict[str, Any]:
    """The object of a report."""
    return strict({"logs": [answer(one) for one in studies], "command": command, "versions": versions})
