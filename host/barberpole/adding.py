"""Put an effect into a model, or take one out, and say whether that pays."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from barberpole.diagnose.candidates import Absent
from barberpole.diagnose.evidence import examine
from barberpole.diagnose.search import attempt
from barberpole.effects import Effect, find_effect
from barberpole.fit.fit import Fit, fit_observations, require_columns
from barberpole.modelfile import ModelFile
from barberpole.observations import Observations

EVIDENCE = 10.0  # fall of the information criterion below which an addition is not believed
FORMS = 3  # of an effect, the most promising, that are fitted exactly


@dataclass(frozen=True)
class Change:
    """A model before and after one effect was added or removed, on the same log.

    after_file  the model with the effect, and with the settings of the form that it takes in this log
    pays        the error on held-out stretches falls, by more than the new parameters' freedom explains
    evidence    fall of the Bayesian information criterion, with the residual's own correlation discounted
    """

    effect: str
    before: Fit
    after: Fit
    after_file: ModelFile
    noise_lsb: float
    evidence: float

    @property
    def pays(self) -> bool:
        return self.evidence > EVIDENCE and self.after.heldout_rms_lsb < self.before.heldout_rms_lsb

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
    old = fit_observations(seen, before, extra, tick)
    require_columns(seen, after.effects, extra)
    new = best_form(old, effect, after.settings, extra) if effect in after.effects else None
    if new is None:
        new = fit_observations(seen, after, extra, tick)
    else:
        name = find_effect(effect, extra).name
        after = replace(after, settings=after.settings | {name: new.setups[name].settings})
    residual = new.problem.residual(new.p)
    return Change(effect, old, new, after, noise_from_differences(residual), _evidence(old, new, residual))


def best_form(fit: Fit, effect: str, settings: dict[str, dict], extra: Sequence[Effect] = ()) -> Fit | None:
    """The exact fit with an effect in the form that gains most, None where no form gains anything."""
    absent = Absent((find_effect(effect, extra),), settings, {})
    evidence = examine(fit, absent, None, extra)
    gains = [evidence.gain(places) for places in evidence.places]
    best = np.argsort(gains)[::-1][:FORMS]
    trials = [trial for at in best if (trial := attempt(evidence, int(at), extra)) is not None]
    return max(trials, key=lambda trial: trial.gain).fit if trials else None


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
