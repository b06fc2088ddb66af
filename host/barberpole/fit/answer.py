"""What a fit says."""

from typing import Any

from barberpole.fit.fit import Fit

FEW = 10  # residuals for each parameter: below, errors are uncertain by a quarter and more, and nothing is named


def remarks(fit: Fit) -> tuple[str, ...]:
    """What a user must know of a fit before its numbers are used, in sentences."""
    free, said = int(fit.free.sum()), []
    if fit.unobservable:
        names = ", ".join(fit.unobservable)
        todo = "turn the sensor through all directions, and vary what the effect depends on"
        said.append(f"this log does not determine {names}, held as if absent: {todo}")
    if not fit.converged:
        said.append("the fit has not converged: its numbers are not to be used")
    readings = fit.gram.count
    if readings < FEW * free:
        said.append(f"{readings} readings are few for {free} parameters: record at least {FEW * free}")
    return tuple(said)


def fit_json(fit: Fit, skipped: int = 0) -> dict[str, Any]:
    """The object of `fit --json`. skipped: rows and records of the log that could not be used."""
    rows = zip(fit.model.names, fit.model.params, fit.p, fit.stderr, fit.free, strict=True)
    return {
        "n": fit.n,
        "rms_lsb": fit.rms_lsb,
        "rms_ut": fit.rms_ut(),
        "rms_norm_percent": fit.rms_norm_percent(),
        "heldout_rms_lsb": fit.heldout_rms_lsb,
        "parameters": {n: {"value": v, "stderr": s, "unit": q.unit} for n, q, v, s, free in rows if free},
        "converged": fit.converged,
        "unobservable": list(fit.unobservable),
        "skipped": skipped,
        "notes": list(remarks(fit)),
    }
