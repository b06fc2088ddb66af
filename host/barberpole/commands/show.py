"""Answers as tables for people."""

from collections.abc import Sequence
from pathlib import Path

from barberpole.adding import Change
from barberpole.commands.console import OUT, say, table
from barberpole.diagnose import Comparison, Diagnosis, Pattern
from barberpole.effects import Effect
from barberpole.fit.fit import Fit
from barberpole.numbers import chance, plain, with_error
from barberpole.summary import Summary
from barberpole.verify import Verification

COLOUR = {"adequate": "bold green", "missing": "bold red", "unexplained": "bold red"}  # the word says it too
MANY = 12  # patterns shown to a person; --json has all


def fit_tables(fit: Fit, output: Path | None) -> None:
    """Parameters with their uncertainty, and the residual."""
    shown = table(f"{fit.n} readings, reference: {fit.problem.seen.reference}", "parameter", "value", "± 1 σ", "unit")
    for name, param, value, error, free in zip(
        fit.model.names, fit.model.params, fit.p, fit.stderr, fit.free, strict=True
    ):
        shown.add_row(name, *(with_error(value, error) if free else ("not determined", "")), param.unit)
    OUT.print(shown)
    norm = fit.rms_norm_percent()
    in_field = f"{norm:.3g} % of the field" if norm is not None else f"{1000 * fit.rms_ut():.4g} nT"
    say(f"residual {fit.rms_lsb:.5g} LSB rms ({in_field}), held out {fit.heldout_rms_lsb:.5g} LSB")
    if output:
        say(f"calibration written to {output}")


def comparison(found: Comparison) -> None:
    """Residual by axis and the patterns in it."""
    axes = ", ".join(f"{axis} {plain(rms)}" for axis, rms in found.rms_by_axis_lsb.items())
    say(f"residual {plain(found.rms_lsb)} LSB rms ({axes}); noise {plain(found.noise_lsb)} LSB", style="bold")
    patterns(found.patterns)


def patterns(found: Sequence[Pattern]) -> None:
    """What the residual follows."""
    if not found:
        say("the residual follows nothing that was logged")
        return
    shown = table("the residual follows", "axis", "against", "shape", "rms LSB", "p")
    for column in shown.columns[1:3]:
        column.justify = "left"
    for p in found[:MANY]:
        shown.add_row(p.axis, p.against, p.shape, plain(p.rms_lsb, 3), chance(p.p_value))
    OUT.print(shown)


def diagnosis(path: Path, found: Diagnosis, model: str) -> None:
    """Verdict first, then what it rests on and what to do next; `model` as it was given."""
    say(
        f"{path.name}: {found.verdict}  ({found.n} readings, residual {plain(found.rms_lsb)} LSB, "
        f"noise {plain(found.noise_lsb)} LSB)",
        style=COLOUR.get(found.verdict, "bold"),
    )
    if found.suspects:
        each = ", each beside those above it" if len(found.suspects) > 1 else ""
        shown = table(f"suspects{each}", "effect", "held-out fall", "rms after LSB", "p", "cannot be told from")
        shown.columns[-1].justify = "left"
        for s in found.suspects:
            shown.add_row(
                s.effect,
                f"{100 * s.heldout_drop:.1f} %",
                plain(s.rms_after_lsb),
                chance(s.p_value),
                ", ".join(s.confounded_with),
            )
        OUT.print(shown)
    patterns(found.patterns)
    if found.cannot_be_seen:
        say(f"this log cannot see: {', '.join(found.cannot_be_seen)}")
    for effect, why in found.cannot_be_judged.items():
        say(f"cannot be judged: {effect}: {why}")
    if found.next_experiment:
        say(f"next: {found.next_experiment}")
    for first in found.suspects[: found.verdict == "missing"]:
        OUT.print(f"put it in: barberpole add {first.effect} --model {model} {path}")


def change(found: Change, model: Path | None) -> None:
    """The fall, and whether it pays."""
    shown = table(f"{found.effect}: {'pays' if found.pays else 'does not pay'}", "error, LSB rms", "before", "after")
    shown.add_row("on the log", f"{found.before.rms_lsb:.5g}", f"{found.after.rms_lsb:.5g}")
    shown.add_row("held out", f"{found.before.heldout_rms_lsb:.5g}", f"{found.after.heldout_rms_lsb:.5g}")
    shown.add_row("noise", "", f"{found.noise_lsb:.5g}")
    OUT.print(shown)
    effects = found.after.model.effects
    if model:
        say(f"{model} now has {', '.join(effects)}")
    else:
        OUT.print(f"go on with --model {','.join(effects)}")


def verification(found: Verification) -> None:
    """Pass or fail, and each check in a sentence."""
    say("pass" if found.passed else "FAIL", style="bold green" if found.passed else "bold red")
    for check in found.checks:
        say(f"{'ok  ' if check.ok else 'FAIL'}  {check.sentence}")


def catalogue(effects: Sequence[Effect]) -> None:
    """The effects with equation and source."""
    shown = table("effects, from the field to the reading", "name", "equation", "source")
    for column in shown.columns:
        column.justify = "left"
    for effect in effects:
        shown.add_row(effect.name, effect.equation, effect.source)
    OUT.print(shown)


def summary(found: Summary) -> None:
    """A log in one screen."""
    say(f"{found.log}: {found.rows} rows{_skipped(found)}", style="bold")
    for line in _facts(found):
        say(line)
    shown = table("", "column", "least", "mean", "greatest", "unit")
    shown.columns[-1].justify = "left"
    for c in found.columns:
        shown.add_row(c.name, plain(c.low), plain(c.mean), plain(c.high), c.unit)
    OUT.print(shown)
    say(f"can show: {', '.join(found.shows) or 'no effect'}")
    reasons: dict[str, list[str]] = {}
    for effect, why in found.cannot_show.items():
        reasons.setdefault(why, []).append(effect)
    for why, effects in reasons.items():
        say(f"cannot show: {', '.join(effects)} ({why})")
    for note in found.notes:
        say(f"note: {note}", style="dim")


def _skipped(found: Summary) -> str:
    return f", {found.skipped} more damaged or incomplete" if found.skipped else ""


def _facts(found: Summary) -> list[str]:
    """What is not a column, a line each."""
    of = {"vector": "the field is known", "magnitude": "its magnitude is known", "constant": "not known, but constant"}
    span = "" if found.field_ut is None else f", {plain(found.field_ut[0])} to {plain(found.field_ut[1])} µT"
    lines = [f"readings      {found.form}; {found.flips} flips", f"reference     {of[found.reference]}{span}"]
    if found.duration_s is not None:
        rate = f"{plain(found.duration_s)} s at {plain(found.rate_hz)} Hz" if found.rate_hz else "times repeat"
        gaps = f"{found.gaps} gaps, the longest {plain(found.longest_gap_s)} s" if found.gaps else "no gaps"
        lines.append(f"time          {rate}; {gaps}")
    else:
        lines.append("time          no t_s column")
    share = f"{100 * found.directions / found.directions_of:.0f} %"
    lines.append(f"directions    {found.directions} of {found.directions_of} ({share}) seen")
    if found.temp_span_c is not None:
        lines.append(f"temperature   spans {plain(found.temp_span_c, 3)} °C")
    lines.append(
        f"at rest       {found.still_rows} rows together" if found.still_rows else "at rest       never for long"
    )
    spiked = ", ".join(f"{axis} {count}" for axis, count in found.spikes.items() if count)
    lines.append(f"spikes        {spiked or 'none'}")
    if found.selfcal_points:
        lines.append(f"coil run      {found.selfcal_points} points")
    return lines
