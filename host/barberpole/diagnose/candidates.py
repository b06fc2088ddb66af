"""The effects a model lacks, in every form they may take in this log."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from barberpole.diagnose.columns import Ground, Shape, shape_of
from barberpole.effects import STACK, Effect, Setup
from barberpole.fit.fit import Fit, missing_columns, setup_of


@dataclass(frozen=True)
class Absent:
    """Effects to judge, each with the settings of its forms, and those that cannot be judged with the reason."""

    effects: tuple[tuple[Effect, tuple[dict[str, Any], ...]], ...]
    unjudged: dict[str, str]


def absent_effects(fit: Fit, extra: Sequence[Effect], settings: dict[str, dict], state_known: bool) -> Absent:
    """What the catalogue and the plugins hold beyond the model."""
    judged, unjudged = [], {}
    for effect in (*STACK, *extra):
        if effect.name in fit.model.effects:
            continue
        lacking = missing_columns(fit.problem.seen, effect)
        if lacking:
            unjudged[effect.name] = f"no {lacking[0]} column"
        else:
            judged.append((effect, _forms(effect, settings.get(effect.name, {}), state_known)))
    return Absent(tuple(judged), unjudged)


def _forms(effect: Effect, settings: dict[str, Any], state_known: bool) -> tuple[dict[str, Any], ...]:
    """A log that does not say its state may be demodulated or of one magnetisation: both are tried."""
    if effect.flips and not state_known and "form" not in settings:
        return settings, settings | {"form": "unflipped"}
    return (settings,)


def shapes(ground: Ground, absent: Absent) -> list[Shape]:
    """Columns of every absent effect at the fitted model."""
    found = []
    for effect, forms in absent.effects:
        if effect.name in ground.fit.model.effects:
            continue
        for settings in forms:
            setup = setup_of(ground.fit.problem.seen, ground.fit.linear, settings)
            found.append(shape_of(_in_form(ground, settings), effect, setup))
    return [shape for shape in found if np.all(np.isfinite(shape.columns))]


def _in_form(ground: Ground, settings: dict[str, Any]) -> Ground:
    """The ground as of one magnetisation, for the form `unflipped`."""
    if settings.get("form") != "unflipped" or len(ground.pathways) == 1:
        return ground
    return replace(ground, pathways=[replace(ground.pathways[0], weight=1.0)])


def setup_for(ground: Ground, shape: Shape) -> Setup:
    """The setup that a refit with this shape takes."""
    return setup_of(ground.fit.problem.seen, ground.fit.linear, shape.settings)
