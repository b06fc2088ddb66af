"""The effects a model lacks, in every form they may take in this log."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from barberpole.diagnose.columns import Candidate, candidate
from barberpole.diagnose.ground import Ground
from barberpole.effects import Effect, Setup, in_order
from barberpole.effects.effect import Shape
from barberpole.fit.fit import Fit, missing_columns, setup_of


@dataclass(frozen=True)
class Absent:
    """Effects to judge with the settings of the model file, and those that cannot be judged with the reason.

    state_known: the log says whether it is demodulated; if not, one magnetisation is tried too.
    """

    effects: tuple[Effect, ...]
    settings: dict[str, dict]
    unjudged: dict[str, str]
    state_known: bool = True


def absent_effects(fit: Fit, extra: Sequence[Effect], settings: dict[str, dict], state_known: bool) -> Absent:
    """What the catalogue and the plugins hold beyond the model."""
    judged, unjudged = [], {}
    for effect in in_order(extra):
        if effect.name in fit.model.effects:
            continue
        lacking = missing_columns(fit.problem.seen, effect)
        if lacking:
            unjudged[effect.name] = f"no {lacking[0]} column"
        else:
            judged.append(effect)
    return Absent(tuple(judged), settings, unjudged, state_known)


def candidates(ground: Ground, absent: Absent) -> list[Candidate]:
    """Columns of every absent effect in each of its forms, at the fitted model."""
    found = []
    for effect in absent.effects:
        if effect.name in ground.fit.model.effects or effect.loss:
            continue
        for shape, setup in _forms(ground, absent, effect):
            one = candidate(ground, effect, shape, setup.settings, setup)
            if one.names and all(np.all(np.isfinite(rows)) for _, rows in one.parts):
                found.append(one)
    return found


def _forms(ground: Ground, absent: Absent, effect: Effect) -> list[tuple[Shape, Setup]]:
    seen, fit = ground.fit.problem.seen, ground.fit
    base = setup_of(seen, fit.linear, absent.settings.get(effect.name))
    shapes = list(effect.forms(base))
    if effect.search:
        # what is left of a scalar reference, laid back on the axes it came from
        residual = ground.residual if ground.normal is None else ground.residual * ground.normal
        shapes += effect.search(base, seen.at, seen.y, residual)
    setups = [(shape, replace(base, settings=base.settings | shape.settings)) for shape in shapes]
    if effect.flips and not absent.state_known and "form" not in base.settings:
        setups += [(s, replace(u, settings=u.settings | {"form": "unflipped"})) for s, u in setups]
    return setups
