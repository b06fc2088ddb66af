"""Put an effect into a model, or take one out, and say whether that pays."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from barberpole.diagnose.candidates import Absent, absent_effects
from barberpole.diagnose.evidence import examine, unsure_of_noise
from barberpole.diagnose.search import attempt, doubtful_readings, forms_tried, giant_readings
from barberpole.diagnose.whitening import whitening
from barberpole.effects import Effect, find_effect
from barberpole.fit.easy_axes import with_easy_axes
from barberpole.fit.fit import Fit, fit_observations, require_columns
from barberpole.modelfile import ModelFile
from barberpole.observations import Observations

EVIDENCE = 10.0  # fall of the information criterion below which an addition is not believed
CLEAR = 0.1  # fall of the held-out error that no noise makes
FORMS = 3  # of an effect, the most promising, that are fitted exactly


@dataclass(frozen=True)
class Change:
    """A model before and after one effect was added or removed, on the same log.

    after_file  the model with the effect, and with the settings of the form that it takes in this log
    evidence    fall of the Bayesian information criterion, with the residual's own correlation discounted
    believed    a diagnosis would take the effect for a cause: it shows in the residual of the model without it, beside
                all that any other cause takes. A fit alone may follow the noise (a play on noisy readings)
    pays        all that, and the error on held-out stretches falls
    """

    effect: str
    before: Fit
    after: Fit
    after_file: ModelFile
    noise_lsb: float
    evidence: float
    believed: bool = True

    @property
    def pays(self) -> bool:
        return self.believed and self.evidence > EVIDENCE and self.after.heldout_rms_lsb < self.before.heldout_rms_lsb

    def to_json(self) -> dict:
        """The object of `add --json`."""
        return {
            "effect": self.effect,
            "rms_before_lsb": self.before.rms_lsb,
            "rms_after_lsb": self.after.rms_lsb,
            "heldout_before_lsb": self.before.heldout_rms_lsb,
            "heldout_after_lsb": self.after.heldout_rms_lsb,
            "noise_lsb": self.noise_lsb,
            "pays": self.pays,
        }


def change(
    seen: Observations,
    before: ModelFile,
    after: ModelFile,
    effect: str,
    extra: Sequence[Effect] = (),
    tick: Callable[[int], None] | None = None,
) -> Change:
    """Fit both models to the observations and compare them.

    An effect that is added may take several forms (a frequency, a period, a time constant to be searched); where the
    model file does not settle that, the form that gains most is taken.
    """
    seen = with_easy_axes(seen)
    old = fit_observations(seen, before, extra, tick)
    require_columns(seen, after.effects, extra)
    adding = effect in after.effects
    new, believed = best_form(old, effect, after.settings, extra) if adding else (None, True)
    if new is None:
        new = fit_observations(seen, after, extra, tick)
    else:
        name = find_effect(effect, extra).name
        after = replace(after, settings=after.settings | {name: new.setups[name].settings})
    residual = new.problem.residual(new.p)
    found = _evidence(old, new, residual)
    noise = examine(new, None, None, extra).background().rms(new.problem.n)
    return Change(effect, old, new, after, noise, found, believed)


def best_form(
    fit: Fit, effect: str, settings: dict[str, dict], extra: Sequence[Effect] = ()
) -> tuple[Fit | None, bool]:
    """The exact fit with an effect in the form that gains most (None where no form gains anything), and whether a
    diagnosis would believe in it."""
    added = find_effect(effect, extra)
    evidence = examine(fit, Absent((added, *_others(fit, added, extra)), settings, {}), None, extra)
    evidence = evidence.under(whitening(evidence.background(), fit.problem.n, evidence.ground.normal))
    if added.loss:
        absent = Absent((added,), settings, {})
        found = doubtful_readings(evidence, absent) or giant_readings(fit, absent)
        return (found.fit, True) if found else (None, False)
    forms = [at for at, form in enumerate(evidence.candidates) if form.effect.name == added.name]
    best = sorted(forms, key=lambda at: -evidence.gain(evidence.places[at]))[:FORMS]
    trials = [trial for at in best if (trial := attempt(evidence, at, extra)) is not None]
    if not trials:
        return None, False
    seen = max(evidence.gain(evidence.places[at], forms_tried(evidence)[added.name]) for at in best) > EVIDENCE
    trial = max(trials, key=lambda trial: trial.gain)
    sure = not unsure_of_noise(evidence) or trial.fit.heldout_rms_lsb < (1.0 - CLEAR) * fit.heldout_rms_lsb
    return trial.fit, seen and sure


def _others(fit: Fit, added: Effect, extra: Sequence[Effect]) -> tuple[Effect, ...]:
    """Every other effect that the log can judge: what they take of the residual is no noise."""
    absent = absent_effects(fit, extra, {}, True).effects
    return tuple(effect for effect in absent if effect.name != added.name)


def _evidence(old: Fit, new: Fit, residual: np.ndarray) -> float:
    """N log(RSS before / RSS after) - p log N with N the number of independent residuals."""
    count = new.gram.count * independent_fraction(residual)
    gained = int(new.free.sum()) - int(old.free.sum())
    return count * np.log(old.gram.cost / max(new.gram.cost, 1e-300)) - gained * np.log(max(count, 2.0))


def independent_fraction(residual: np.ndarray) -> float:
    """Effective over actual number of samples of (m, n) residuals, from their correlation with the next sample."""
    if residual.shape[1] < 3:
        return 1.0
    power = float(np.sum(residual**2))
    next_to = float(np.sum(residual[:, 1:] * residual[:, :-1])) / max(power, 1e-300)
    return (1.0 - max(next_to, 0.0)) / (1.0 + max(next_to, 0.0))


def noise_from_differences(residual: np.ndarray) -> float:
    """White noise in LSB from neighbouring residuals (m, n), blind to what varies slowly (von Neumann)."""
    if residual.shape[1] < 3:
        return float("nan")
    return float(np.sqrt(np.mean(np.diff(residual, axis=1) ** 2) / 2.0))
