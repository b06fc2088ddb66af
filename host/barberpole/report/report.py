"""`barberpole report`: a study of each log as one page, the verdict first."""

import platform
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from barberpole import __version__
from barberpole.figures import gains, parameters, points
from barberpole.figures.figure import listed
from barberpole.figures.parameters import SURE
from barberpole.numbers import plain, signed, with_error
from barberpole.report.cited import Answer
from barberpole.report.page import Section, Table, Text, write_page
from barberpole.report.parts import checks, fails, falls, follows, grounds, missing
from barberpole.report.study import Study
from barberpole.verify import GAIN_DRIFT

MARK = {"adequate": "good", "accepted": "good", "missing": "bad", "unexplained": "bad", "refused": "bad"}
PACKAGES = ("numpy", "scipy", "pyarrow", "plotly")


def versions() -> dict[str, str]:
    """What the numbers were computed with."""
    return {"barberpole": __version__, "python": platform.python_version()} | {p: version(p) for p in PACKAGES}


def write_report(path: Path, studies: Sequence[Study], answer: dict[str, Any]) -> None:
    """Write the page. answer: what --json prints of the same studies."""
    whole = Answer(answer)
    parts = [(one, whole.at("logs", at)) for at, one in enumerate(studies)]
    if len(studies) == 1:
        one, part = parts[0]
        title, said, mark, sections = title_of(one), verdict(one, part), mark_of(one), chapter(one, part)
    else:
        title, said, mark = f"{len(studies)} logs", _together(studies), _worst(studies)
        sections = [_overview(parts), *_power_ups(studies)]
        for one, part in parts:
            opening = Section(title_of(one), verdict(one, part), level=1, mark=mark_of(one))
            sections += [opening, *chapter(one, part)]
    write_page(path, title, said, mark, sections, provenance(studies, answer), answer)


def title_of(study: Study) -> str:
    """Log and model."""
    against = f" against {', '.join(study.given.file.effects)}" if study.diagnosis else ": self-calibration"
    return f"{study.log.path.name}{against}"


def mark_of(study: Study) -> str:
    """good, bad or open."""
    if study.check and not study.check.passed:
        return "bad"
    return MARK.get(study.verdict, "open")


def verdict(study: Study, answer: Answer) -> Markup:
    """The answer in a few sentences, its numbers cited."""
    return Markup(" ").join(s for s in (_diagnosed(study, answer), _against_calibration(study), _coil(study)) if s)


def _diagnosed(study: Study, answer: Answer) -> Markup:
    found = study.diagnosis
    if found is None:
        return Markup("")
    leaves = answer.say("The model leaves {fit rms_lsb} LSB rms; the noise is {noise_lsb} LSB.") if study.fit else ""
    following = f"{found.next_experiment[:1].upper()}{found.next_experiment[1:]}".rstrip(".")
    if found.verdict == "missing":
        names = [s.effect for s in found.suspects]
        last, one = len(study.path) - 1, len(names) == 1
        falls = f"falls from {{path {last - len(names)} heldout_lsb}} to {{path {last} heldout_lsb}} LSB."
        with_it = answer.say(f"With {'it' if one else 'them'} the error on stretches not fitted {falls}")
        return Markup("{} {} missing. {} {}").format(listed(names), "is" if one else "are", leaves, with_it)
    said = {
        "adequate": "Adequate: nothing significant is left.",
        "unexplained": "Unexplained: something is left that no effect of the catalogue explains.",
    }.get(
        found.verdict, f"{found.verdict.capitalize()}: {following}." if following else f"{found.verdict.capitalize()}."
    )
    return Markup("{} {}").format(said, leaves)


def _against_calibration(study: Study) -> Markup:
    name = study.given.calibration.path.name if study.given.calibration and study.given.calibration.path else ""
    if study.refused:
        return Markup("It cannot be held against {}: {}.").format(name, study.refused)
    if study.check is None:
        return Markup("")
    holds = "still holds" if study.check.passed else "does not hold"
    return Markup("The calibration {} {} for this log.").format(name, holds)


def _coil(study: Study) -> str:
    if study.log.selfcal is None or study.diagnosis is not None:
        return ""
    count = study.log.selfcal.unit.shape[1]
    said = {"accepted": "The board accepted its self-calibration", "refused": "The board refused its self-calibration"}
    return f"{said.get(study.verdict, 'The coil run has no verdict')} of {count} points."


def chapter(study: Study, answer: Answer) -> list[Section]:
    """The sections of one log."""
    out: list[Section] = []
    if study.fit and study.comparison:
        ground = grounds(study.fit)
        out += [follows(study.fit, ground), fails(study.comparison, answer.at("comparison"), study.fit, ground)]
    if study.diagnosis:
        out.append(missing(study.diagnosis, answer.at("diagnosis")))
    if study.path:
        out.append(falls(study.path, study.noise_lsb, answer.at("path")))
    if study.fit:
        out.append(worth(study, answer))
    if study.log.selfcal is not None:
        out.append(selfcal(study, answer.at("selfcal")))
    if study.check:
        out.append(checks(study.check, "Does the calibration still hold?"))
    return [*out, holds(study, answer.at("summary"))]


def worth(study: Study, answer: Answer) -> Section:
    """Parameters with their uncertainty and, beside a calibration, their change."""
    figures = [parameters(study.values, study.factory or None)]
    head = ["parameter", "value", "± 1 σ", "unit"]
    if study.factory:
        head += ["factory", "change", "change, σ"]
    rows = [_row(name, study, answer) for name in study.values]
    frozen = study.fit.unobservable if study.fit else ()
    lacking = f" This log does not determine {', '.join(frozen)}." if frozen else ""
    since = f" Changed is what moved by more than {SURE:g} standard errors." if study.factory else ""
    said = f"Values at {plain(study.fit.problem.seen.at.t0_c)} °C with one standard error." if study.fit else ""
    return Section("What are the parameters?", f"{said}{since}{lacking}", figures, [Table(head, rows)])


def _row(name: str, study: Study, answer: Answer) -> list[Text]:
    part = answer.at("fit", "parameters", name)
    value, error = with_error(part.value["value"], part.value["stderr"] or 0.0)
    row: list[Text] = [name, part.number("value", form=lambda _: value), part.number("stderr", form=lambda _: error)]
    row.append(study.values[name].unit.replace("uT", "µT"))
    if not study.factory:
        return row
    if name not in study.factory:
        return [*row, "", "", ""]
    then = answer.at("factory", name)
    numbers = (("value", lambda v: f"{v:.7g}"), ("change", lambda v: signed(v, 2)), ("sigma", lambda v: signed(v, 2)))
    return [*row, *(then.number(key, form=form) for key, form in numbers)]


def selfcal(study: Study, answer: Answer) -> Section:
    """The coil run: the board's gains, the host's from the same points, and what each point leaves."""
    head, rows = ["axis", "gain, board", "residual, board, µT"], []
    if study.coil is not None:
        head += ["gain, host", "residual, host, µT"]
    for at, axis in enumerate("xyz"):
        row: list[Text] = [axis, *(_of(answer, f"board_{key}", at) for key in ("gain", "residual_ut"))]
        if study.coil is not None:
            row += [_of(answer.at("host"), key, at) for key in ("gain", "residual_ut")]
        rows.append(row)
    figures = []
    if study.coil is not None:
        figures = [gains([study.log.path.name], study.coil.gain[None], GAIN_DRIFT), points(study.coil.left_ut)]
    said = answer.say("{points} points at {temp_c:3} °C; gains over the factory's (thesis 6.7).")
    return Section("What does the self-calibration say?", said, figures, [Table(head, rows)])


def _of(answer: Answer, key: str, at: int) -> Text:
    digits = 7 if key.endswith("gain") else 3
    return answer.number(key, at, form=lambda v: plain(v, digits)) if answer.value.get(key) else "not known"


def holds(study: Study, answer: Answer) -> Section:
    """What the log holds."""
    found = study.summary
    rows: list[tuple[Text, ...]] = []
    for at, column in enumerate(found.columns):
        part = answer.at("columns", at)
        rows.append((column.name, *(part.number(key) for key in ("low", "mean", "high")), column.unit))
    said = answer.say("{rows} rows; the field pointed into {directions} of {directions_of} directions. ")
    said += f"Readings: {found.form}; reference: {found.reference}."
    table = Table(("column", "least", "mean", "greatest", "unit"), rows)
    cannot = [(name, why) for name, why in found.cannot_show.items()]
    tables = [table, Table(("it cannot show", "because"), cannot)] if cannot else [table]
    return Section("What does the log hold?", said, (), tables)


def _overview(parts: Sequence[tuple[Study, Answer]]) -> Section:
    """One row a log."""
    rows: list[tuple[Text, ...]] = []
    for one, part in parts:
        named = ", ".join(s.effect for s in one.diagnosis.suspects) if one.diagnosis else ""
        rms = part.number("fit", "rms_lsb") if one.fit else "not fitted"
        rows.append((one.log.path.name, one.verdict, named, rms, part.number("noise_lsb") if one.fit else ""))
    head = ("log", "verdict", "suspects", "residual, LSB rms", "noise, LSB")
    return Section("What does each log say?", "One chapter a log follows.", (), [Table(head, rows)])


def _power_ups(studies: Sequence[Study]) -> list[Section]:
    """Gains over power-ups, where several logs hold a coil run."""
    runs = [(one.log.path.name, one.coil.gain) for one in studies if one.coil is not None]
    if len(runs) < 2:
        return []
    drawn = gains([name for name, _ in runs], np.stack([gain for _, gain in runs]), GAIN_DRIFT)
    return [Section("Do the gains hold from power-up to power-up?", "In the order given.", [drawn])]


def _together(studies: Sequence[Study]) -> str:
    counted = {word: sum(one.verdict == word for one in studies) for word in dict.fromkeys(s.verdict for s in studies)}
    return "; ".join(f"{count} {word}" for word, count in counted.items()) + "."


def _worst(studies: Sequence[Study]) -> str:
    marks = {mark_of(one) for one in studies}
    return next(mark for mark in ("bad", "open", "good") if mark in marks)


def provenance(studies: Sequence[Study], answer: dict[str, Any]) -> str:
    """Hashes, versions, and the command that gives this page again."""
    lines = [f"log {one.log.path.name}  sha256 {one.log.sha256}" for one in studies]
    for found in dict.fromkeys(one.given.calibration for one in studies if one.given.calibration):
        lines.append(f"calibration {found.path.name if found.path else ''}  {found.hash}, from log {found.log_name}")
    lines.append(", ".join(f"{name} {number}" for name, number in answer["versions"].items()))
    lines.append(f"repeat it: {answer['command']}")
    return "\n".join(lines)
