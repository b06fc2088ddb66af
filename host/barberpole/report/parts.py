"""The sections that report, comparison and demo share: each a question, its answer, and what shows it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from barberpole.diagnose import Comparison, Diagnosis, Pattern
from barberpole.diagnose.covariates import Covariate, covariates
from barberpole.diagnose.ground import Ground, ground_of
from barberpole.figures import (
    Figure,
    Stage,
    residual_against,
    residual_axes,
    residual_curves,
    residual_spectrum,
    sphere,
    suspects,
    traces,
    waterfall,
)
from barberpole.fit.fit import Fit
from barberpole.numbers import plain
from barberpole.report.cited import Answer
from barberpole.report.page import Section, Table, Text
from barberpole.verify import Verification

DRAWN = 3  # covariates, those that the residual follows most
LISTED = 12  # patterns


def follows(fit: Fit, ground: Ground) -> Section:
    """Model against measurement over time; for a scalar reference, the magnitude of the calibrated field."""
    seen = fit.problem.seen
    t, name = (seen.at.t_s, "time, s") if seen.at.t_s is not None else (np.arange(fit.problem.n), "reading, number")
    if seen.b_ut is not None:
        drawn = traces(t, seen.y, seen.y - ground.residual, t_name=name)
    else:
        known = np.broadcast_to(fit.problem.magnitude(slice(None)), (fit.problem.n,))
        drawn = traces(t, np.linalg.norm(fit.field(), axis=0), known, ("norm",), "µT", name)
    return Section("Does the model follow the measurement?", "", [drawn])


def fails(found: Comparison, answer: Answer, fit: Fit | None = None, ground: Ground | None = None) -> Section:
    """Residual by axis, against what it follows most, on the sphere, by frequency."""
    figures = [residual_axes(found.rms_by_axis_lsb, found.noise_lsb)]
    figures += against(found, fit, ground)
    figures += [sphere(found.sphere), residual_spectrum(found)]
    rows = [_pattern(p, answer.at("patterns", at)) for at, p in enumerate(found.patterns[:LISTED])]
    head = ("axis", "against", "shape", "rms, LSB", "chance")
    if not rows:
        return Section("Where does it fail?", "The residual follows nothing that was logged: it is noise.", figures)
    said = "What the residual follows, strongest first; the chance is that of so much in the noise found."
    return Section("Where does it fail?", said, figures, [Table(head, rows)])


def _pattern(pattern: Pattern, answer: Answer) -> tuple[Text, ...]:
    numbers = answer.number("rms_lsb", form=lambda v: plain(v, 3)), answer.number("p_value", form=lambda v: f"{v:.0e}")
    return (pattern.axis, pattern.against, pattern.shape, *numbers)


def against(found: Comparison, fit: Fit | None = None, ground: Ground | None = None) -> list[Figure]:
    """The residual against the covariates that it follows most, each once, the points too where there is a fit."""
    drawn: dict[str, Figure] = {}
    known = {c.against for c in found.curves}
    things = {c.name: c for c in covariates(fit.problem.seen, ground.field)} if fit and ground else {}
    for pattern in found.patterns:
        if pattern.against in known and pattern.against not in drawn and len(drawn) < DRAWN:
            figure = _against(found, pattern, things.get(pattern.against), ground)
            if not drawn:
                figure = replace(figure, title=figure.title.replace(" fails against ", " fails most against ", 1))
            drawn[pattern.against] = figure
    return list(drawn.values())


def _against(found: Comparison, pattern: Pattern, thing: Covariate | None, ground: Ground | None) -> Figure:
    if thing is None or ground is None or thing.value is None or thing.period:
        return residual_curves(found, pattern.against, pattern)
    name = f"{thing.words}, {thing.unit}" if thing.unit else thing.words
    return residual_against(ground.residual, thing.value, name, ground.axes, found.noise_lsb, pattern)


def missing(found: Diagnosis, answer: Answer) -> Section:
    """Suspects with what they explain, what cannot be seen or judged, and what to do next."""
    head = ("effect", "held-out error falls by, %", "rms after, LSB", "cannot be told from")
    rows: list[tuple[Text, ...]] = []
    for at, suspect in enumerate(found.suspects):
        part = answer.at("suspects", at)
        drop = part.number("heldout_drop", form=lambda v: f"{100 * v:.1f}")
        rivals = ", ".join(suspect.confounded_with) or "nothing"
        rows.append((suspect.effect, drop, part.number("rms_after_lsb"), rivals))
    unsaid = [name for name in found.cannot_be_seen if name not in found.next_experiment]
    blind = f" This log cannot show {', '.join(unsaid)}." if unsaid else ""
    unjudged = "; ".join(f"{name}: {why}" for name, why in found.cannot_be_judged.items())
    unjudged = f" Cannot be judged: {unjudged}." if unjudged else ""
    following = f"{found.next_experiment[:1].upper()}{found.next_experiment[1:]}".rstrip(".")
    sentence = f"Verdict: {found.verdict}.{' ' + following + '.' if following else ''}{blind}{unjudged}"
    figures = [suspects(found)] if found.suspects else []
    return Section("Which effect is missing?", sentence, figures, [Table(head, rows)] if rows else [])


def falls(stages: Sequence[Stage], noise_lsb: float, answer: Answer) -> Section:
    """The error after each added effect, with the noise floor."""
    rows = [
        (stage.name, answer.number(at, "heldout_lsb"), answer.number(at, "rms_lsb")) for at, stage in enumerate(stages)
    ]
    head = ("model", "held out, LSB rms", "on the log, LSB rms")
    said = "Held out: on stretches of the log that were not fitted. No model can go below the noise for long."
    figures = [waterfall(stages, noise_lsb)]
    return Section("Does the error fall with each effect?", said, figures, [Table(head, rows)])


def checks(found: Verification, title: str) -> Section:
    """Each check in a sentence, with its answer."""
    rows = [(check.sentence, "yes" if check.ok else "NO") for check in found.checks]
    said = "Every check holds." if found.passed else "Not every check holds."
    return Section(title, said, (), [Table(("check", "holds"), rows)], mark="good" if found.passed else "bad")


def grounds(fit: Fit) -> Ground:
    """Residual and field of a fit, computed once for several sections."""
    return ground_of(fit, fit.extra)
