"""What a fit says."""

from typing import Any

from barberpole.fit.fit import Fit


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
    }
