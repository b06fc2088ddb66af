"""What a diagnosis says."""

from dataclasses import asdict, dataclass, field
from typing import Any

from barberpole.diagnose.candidates import Absent
from barberpole.diagnose.patterns import Pattern
from barberpole.diagnose.search import Found
from barberpole.diagnose.still import Still
from barberpole.diagnose.visibility import Visible
from barberpole.fit.fit import Fit
from barberpole.observations import Observations


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
    visibility: dict[str, Visible] = field(default_factory=dict)
    fits: tuple[Fit, ...] = field(default=(), repr=False)

    def to_json(self) -> dict[str, Any]:
        """Plain numbers, strings, lists and dictionaries."""
        shown = {k: v for k, v in vars(self).items() if k not in ("fits", "visibility")}
        shown["suspects"] = [asdict(s) | {"confounded_with": list(s.confounded_with)} for s in self.suspects]
        shown["patterns"] = [asdict(p) for p in self.patterns]
        return shown | {"cannot_be_seen": list(self.cannot_be_seen)}


def suspect(found: Found) -> Suspect:
    return Suspect(found.effect, found.p_value, found.fit.rms_lsb, found.heldout_drop, found.rivals)


def at_rest_answer(seen: Observations, found: Still) -> Diagnosis:
    """A group of causes at most: nothing here tells one from another."""
    suspects = tuple(Suspect(name, 1e-300, found.noise_lsb, 0.0, found.causes[1:]) for name in found.causes[:1])
    n = seen.y.shape[1]
    return Diagnosis("inconclusive", n, found.noise_lsb, found.rms_lsb, suspects, found.patterns, (), {}, found.advice)


def inconclusive(seen: Observations, why: str, fit: Fit | None = None, absent: Absent | None = None) -> Diagnosis:
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
