"""Every effect the model lacks, ranked: named by the diagnosis, next what else would explain part of the residual."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from barberpole.diagnose import Diagnosis, diagnose_observations
from barberpole.diagnose.candidates import absent_effects
from barberpole.diagnose.evidence import Evidence, examine
from barberpole.diagnose.search import ALIKE, ENOUGH
from barberpole.diagnose.stretches import part_of
from barberpole.diagnose.whitening import whitening
from barberpole.effects import Effect, find_effect
from barberpole.fit.fit import Fit
from barberpole.observations import observations
from barberpole.workbench.bench import Bench
from barberpole.workbench.lab import Lab

SHOWN = 0.01  # of what is left: an effect that would explain less is not listed


@dataclass(frozen=True)
class Suspect:
    """One absent effect. explains: part of the residual above the noise that it could take, 0..1.

    named: the diagnosis names it; heldout_drop: by how much the held-out error then falls (None where not fitted).
    settings: of the form it takes in this log. why: a remark where it is not to be believed.
    """

    effect: str
    equation: str
    summary: str
    source: str
    explains: float
    named: bool = False
    heldout_drop: float | None = None
    heldout_lsb: float | None = None
    p_value: float | None = None
    confounded_with: tuple[str, ...] = ()
    settings: dict | None = None
    why: str = ""


@dataclass(frozen=True)
class Suspicion:
    """What the diagnosis says, and the whole ranking."""

    verdict: str
    noise_lsb: float
    rms_lsb: float
    next_experiment: str
    suspects: tuple[Suspect, ...]
    patterns: tuple[tuple[str, str, str, float], ...] = ()
    cannot_be_seen: tuple[str, ...] = ()
    cannot_be_judged: dict[str, str] = field(default_factory=dict)


def suspicion(lab: Lab, bench: Bench) -> Suspicion:
    """Judge the model on the bench and rank what it lacks."""
    seen, extra = lab.seen(bench), lab.extra(bench)
    known = bool(np.any(np.asarray(seen.at.state))) or lab.log(bench.log).has("state")
    rest = None if bench.rest is None else observations(lab.log(bench.rest))
    found = diagnose_observations(seen, bench.file, rest, extra, known)
    named = _named(found, extra)
    others = _others(found, bench, extra, known) if found.fits else ()
    patterns = tuple((p.axis, p.against, p.shape, float(p.rms_lsb)) for p in found.patterns)
    return Suspicion(
        found.verdict,
        _floor(found),
        found.rms_lsb,
        found.next_experiment,
        _ranked(named, others),
        patterns,
        found.cannot_be_seen,
        found.cannot_be_judged,
    )


def _floor(found: Diagnosis) -> float:
    """The noise, which is not more than what the best fit leaves."""
    return float(np.nanmin([found.noise_lsb, *(fit.rms_lsb for fit in found.fits)]))


def _ranked(named: Sequence[Suspect], others: Sequence[Suspect]) -> tuple[Suspect, ...]:
    """The named first, in the order found, with what they explain; then the others, strongest first."""
    by_name = {one.effect: one for one in others}
    first = [_with_share(one, by_name[one.effect]) if one.effect in by_name else one for one in named]
    taken = {one.effect for one in first}
    return (*first, *(one for one in others if one.effect not in taken))


def _with_share(one: Suspect, other: Suspect) -> Suspect:
    return Suspect(**{**vars(one), "explains": other.explains})


def _named(found: Diagnosis, extra: Sequence[Effect]) -> list[Suspect]:
    """The diagnosis's own suspects, each with the settings of the fit it was found by."""
    out = []
    before = found.fits[0].rms_lsb if found.fits else found.rms_lsb
    fits: Sequence[Fit | None] = found.fits[1:] if found.fits else [None] * len(found.suspects)
    for one, fit in zip(found.suspects, fits, strict=True):
        settings = dict(fit.setups[one.effect].settings) if fit else {}
        share = (before**2 - one.rms_after_lsb**2) / max(before**2 - found.noise_lsb**2, 1e-300)
        described = _described(one.effect, min(max(share, 0.0), 1.0), extra)
        out.append(
            Suspect(
                **{
                    **vars(described),
                    "named": found.verdict in ("missing", "unexplained"),
                    "heldout_drop": one.heldout_drop,
                    "heldout_lsb": fit.heldout_rms_lsb if fit else None,
                    "p_value": one.p_value,
                    "confounded_with": one.confounded_with,
                    "settings": settings,
                }
            )
        )
    return out


def _described(name: str, share: float, extra: Sequence[Effect]) -> Suspect:
    effect = find_effect(name, extra)
    return Suspect(name, effect.equation, effect.summary, effect.source, share)


def _others(found: Diagnosis, bench: Bench, extra: Sequence[Effect], known: bool) -> list[Suspect]:
    """Every candidate's best form by what it would take of the residual, whether believed or not."""
    fit = part_of(found.fits[0])
    absent = absent_effects(fit, extra, bench.file.settings, known)
    evidence = examine(fit, absent, None, extra)
    evidence = evidence.under(whitening(evidence.background(), fit.problem.n, evidence.ground.normal))
    best: dict[str, tuple[float, int]] = {}
    for at, (form, columns) in enumerate(zip(evidence.candidates, evidence.places, strict=True)):
        share = _share(evidence, columns) if evidence.gain(columns, form.tried) > ENOUGH else 0.0
        if share > best.get(form.effect.name, (SHOWN, 0))[0]:
            best[form.effect.name] = (share, at)
    ranked = sorted(best.items(), key=lambda item: -item[1][0])
    return [_other(evidence, name, share, at, ranked, extra) for name, (share, at) in ranked]


def _share(evidence: Evidence, columns: np.ndarray) -> float:
    """Part of the whitened sum of squares above what noise would leave that these columns take."""
    score, rank = evidence.projection.score(columns)
    excess = evidence.projection.rss - evidence.projection.freedom
    return float(np.clip((score - rank) / excess, 0.0, 1.0)) if excess > 0 else 0.0


def _other(evidence: Evidence, name: str, share: float, at: int, ranked, extra: Sequence[Effect]) -> Suspect:
    alike = tuple(
        other
        for other, (_, place) in ranked
        if other != name and evidence.projection.likeness(evidence.places[at], evidence.places[place]) > ALIKE
    )
    settings = dict(evidence.candidates[at].setup.settings)
    described = _described(name, share, extra)
    return Suspect(**{**vars(described), "confounded_with": alike, "settings": settings})
