"""Answers as tables for people, and the JSON that is not already an object's own."""

from collections.abc import Sequence
from pathlib import Path

from barberpole.adding import Change
from barberpole.commands.console import OUT, table
from barberpole.diagnose import Comparison, Diagnosis, Pattern
from barberpole.effects import Effect
from barberpole.fit.fit import Fit
from barberpole.log import Log
from barberpole.verify import Verification

MANY = 12  # patterns shown to a person; --json has all


def fit_json(fit: Fit, log: Log) -> dict:
    """The object of `fit --json`."""
    rows = zip(fit.model.names, fit.model.params, fit.p, fit.stderr, fit.free, strict=True)
    return {
        "n": fit.problem.n,
        "rms_lsb": fit.rms_lsb,
        "rms_ut": fit.rms_ut(),
        "rms_norm_percent": fit.rms_norm_percent(),
        "heldout_rms_lsb": fit.heldout_rms_lsb,
        "parameters": {n: {"value": v, "stderr": s, "unit": q.unit} for n, q, v, s, free in rows if free},
        "converged": fit.converged,
        "unobservable": list(fit.unobservable),
        "skipped": log.skipped,
    }


def fit_tables(fit: Fit, output: Path | None) -> None:
    """Parameters with their uncertainty, and the residual."""
    shown = table(
        f"{fit.problem.n} readings, reference: {fit.problem.seen.reference}", "parameter", "value", "± 1 σ", "unit"
    )
    for name, param, value, error, free in zip(
        fit.model.names, fit.model.params, fit.p, fit.stderr, fit.free, strict=True
    ):
        shown.add_row(name, f"{value:.6g}" if free else "not determined", f"{error:.2g}" if free else "", param.unit)
    OUT.print(shown)
    norm = fit.rms_norm_percent()
    in_field = f"{norm:.3g} % of the field" if norm is not None else f"{1000 * fit.rms_ut():.4g} nT"
    OUT.print(f"residual {fit.rms_lsb:.5g} LSB rms ({in_field}), held out {fit.heldout_rms_lsb:.5g} LSB")
    if output:
        OUT.print(f"calibration written to {output}")


def comparison(found: Comparison) -> None:
    """Residual by axis and the patterns in it."""
    axes = ", ".join(f"{axis} {rms:.4g}" for axis, rms in found.rms_by_axis_lsb.items())
    OUT.print(f"residual {found.rms_lsb:.4g} LSB rms ({axes}); noise {found.noise_lsb:.4g} LSB")
    patterns(found.patterns)


def patterns(found: Sequence[Pattern]) -> None:
    """What the residual follows."""
    if not found:
        OUT.print("the residual follows nothing that was logged")
        return
    shown = table("the residual follows", "axis", "against", "shape", "rms LSB", "p")
    for p in found[:MANY]:
        shown.add_row(p.axis, p.against, p.shape, f"{p.rms_lsb:.3g}", f"{p.p_value:.1e}")
    OUT.print(shown)


def diagnosis(path: Path, found: Diagnosis) -> None:
    """Verdict first, then what it rests on."""
    OUT.print(
        f"{path.name}: {found.verdict}  ({found.n} readings, residual {found.rms_lsb:.4g} LSB, "
        f"noise {found.noise_lsb:.4g} LSB)",
        style="bold",
    )
    if found.suspects:
        shown = table("suspects", "effect", "held-out fall", "rms after LSB", "p", "cannot be told from")
        for s in found.suspects:
            shown.add_row(
                s.effect,
                f"{100 * s.heldout_drop:.1f} %",
                f"{s.rms_after_lsb:.4g}",
                f"{s.p_value:.1e}",
                ", ".join(s.confounded_with),
            )
        OUT.print(shown)
    patterns(found.patterns)
    if found.cannot_be_seen:
        OUT.print(f"this log cannot see: {', '.join(found.cannot_be_seen)}")
    for effect, why in found.cannot_be_judged.items():
        OUT.print(f"cannot be judged: {effect}: {why}")
    if found.next_experiment:
        OUT.print(f"next: {found.next_experiment}")


def change(found: Change, model: Path | None) -> None:
    """The fall, and whether it pays."""
    shown = table(f"{found.effect}: {'pays' if found.pays else 'does not pay'}", "error, LSB rms", "before", "after")
    shown.add_row("on the log", f"{found.before.rms_lsb:.5g}", f"{found.after.rms_lsb:.5g}")
    shown.add_row("held out", f"{found.before.heldout_rms_lsb:.5g}", f"{found.after.heldout_rms_lsb:.5g}")
    shown.add_row("noise", "", f"{found.noise_lsb:.5g}")
    OUT.print(shown)
    if model:
        OUT.print(f"{model} now has {', '.join(found.after.model.effects)}")


def verification(found: Verification) -> None:
    """Pass or fail, and each check in a sentence."""
    OUT.print("pass" if found.passed else "FAIL", style="bold")
    for check in found.checks:
        OUT.print(f"{'ok  ' if check.ok else 'FAIL'}  {check.sentence}")


def catalogue(effects: Sequence[Effect]) -> None:
    """The effects with equation and source."""
    shown = table("effects, from the field to the reading", "name", "equation", "source")
    for column in shown.columns:
        column.justify = "left"
    for effect in effects:
        shown.add_row(effect.name, effect.equation, effect.source)
    OUT.print(shown)
