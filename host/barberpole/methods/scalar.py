"""The published scalar methods as fits: their answer as bias, scale and misalignment, judged like any other fit."""

from dataclasses import replace

import numpy as np

from barberpole.columns import READINGS
from barberpole.errors import InputError, must
from barberpole.fit import observability
from barberpole.fit.fit import NOMINAL_MAGNITUDE_UT, Fit, setup_of
from barberpole.fit.gram import accumulate
from barberpole.fit.residual import Problem
from barberpole.fit.start import Linear, start_values
from barberpole.log import Log
from barberpole.methods.ellipsoid import Ellipsoid, algebraic, coverage_message
from barberpole.model import compose
from barberpole.modelfile import ModelFile
from barberpole.observations import Observations, observations

EFFECTS = ("bias", "scale", "misalignment")
GAIN_RATIO = 8.0  # between the axes of one sensor; more is a flat cloud drawn out into a sphere
GAIN_STDERR = 0.05  # relative standard error of a gain above which the surface was not seen


def ellipsoid(log: Log, reference: dict | None = None) -> tuple[Fit, ModelFile]:
    """Two-step ellipsoid (thesis 4.8-4.20) of a log whose field has one magnitude; its fit and the model it stands for.

    `reference` may give magnitude_ut; else the log's b_ut, else 50 µT with gains relative to it.
    Raises InputError when the log does not surround the sensor, saying what is missing.
    """
    file = ModelFile(EFFECTS, reference=reference or {})
    seen = demodulated(log)
    magnitude = float(file.reference.get("magnitude_ut", NOMINAL_MAGNITUDE_UT))
    known = float(np.mean(seen.b_mag)) if seen.b_mag is not None else magnitude
    if seen.b_mag is not None and np.ptp(seen.b_mag) > 1e-3 * known:
        got = f"b_ut from {seen.b_mag.min():.4g} to {seen.b_mag.max():.4g} µT (fit without --method takes them all)"
        raise InputError(must("an ellipsoid fit", "given one field magnitude", got, log.path))
    shape = algebraic(seen.y, known)
    return _judged(shape, seen, known), file


def demodulated(log: Log) -> Observations:
    """The log as a scalar method sees it: one demodulated reading a row, and at most the magnitude of the field."""
    plain = replace(log, columns={n: v for n, v in log.columns.items() if "_set_" not in n and "_reset_" not in n})
    seen = observations(plain)
    if np.any(seen.at.state) or not log.has(*READINGS):
        got = "SET and RESET in turns in x_lsb.. (fit without --method takes them)"
        raise InputError(must("an ellipsoid fit", "given demodulated readings", got, log.path))
    magnitude = np.linalg.norm(seen.b_ut, axis=0) if seen.b_ut is not None else seen.b_mag
    return replace(seen, b_ut=None, b_mag=magnitude, reference="constant" if magnitude is None else "magnitude")


def _judged(shape: Ellipsoid, seen: Observations, known: float) -> Fit:
    linear = Linear(np.linalg.inv(shape.upper), shape.centre, known)
    setups = {name: setup_of(seen, linear) for name in EFFECTS}
    model = compose(EFFECTS, setups)
    problem = Problem(model, seen, known)
    p = start_values(model, linear)
    gram = accumulate(problem, p)
    free = np.ones(len(p), bool)
    fit = Fit(problem, p, observability.covariance(gram, free), gram, free, True, linear, setups)
    _require_seen(fit, seen)
    return fit


def _require_seen(fit: Fit, seen: Observations) -> None:
    """Refuse an ellipsoid that the data only suggest: a flat cloud drawn out, or gains of no certainty."""
    gains = {n: (v, s) for n, v, s in zip(fit.model.names, fit.p, fit.stderr, strict=True) if n.startswith("scale.")}
    values = np.abs([v for v, _ in gains.values()])
    worst = max(s / abs(v) for v, s in gains.values())
    if values.max() > GAIN_RATIO * values.min() or worst > GAIN_STDERR:
        raise InputError(coverage_message(seen.y))
