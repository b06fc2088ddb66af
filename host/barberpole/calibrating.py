"""A fit becomes a calibration: numbers with standard errors, where they hold, and the coils' factory response."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from barberpole.board_log import SelfcalRun
from barberpole.calibration import Calibration
from barberpole.calibration_tables import Residual, Step, Validity, Value
from barberpole.fit.fit import Fit
from barberpole.fitted import from_calibration
from barberpole.log import Log
from barberpole.modelfile import ModelFile
from barberpole.sensor import Sensor


def calibration_of(
    fit: Fit, log: Log, file: ModelFile, method: str = "fit", history: Sequence[Step] = ()
) -> Calibration:
    """What was fitted, as it is written to calibration.toml."""
    free = fit.free
    params = zip(fit.model.names, fit.model.params, fit.p, fit.stderr, free, strict=True)
    return Calibration(
        model=file,
        parameters={n: Value(float(v), float(s), q.unit) for n, q, v, s, kept in params if kept},
        covariance=fit.covariance[np.ix_(free, free)],
        residual=residual_of(fit),
        log_name=log.path.name,
        log_sha256=log.sha256,
        unobservable=fit.unobservable,
        validity=validity_of(fit),
        history=tuple(history),
        easy_axis=fit.problem.seen.at.easy_axis,
        t0_c=fit.problem.seen.at.t0_c,
        method=method,
    )


def residual_of(fit: Fit) -> Residual:
    """How well the fit does."""
    found = fit.figures
    return Residual(
        n=fit.n,
        rms_lsb=fit.rms_lsb,
        rms_ut=found.rms_ut,
        noise_lsb=found.noise_lsb,
        heldout_rms_lsb=fit.heldout_rms_lsb,
        rms_norm_percent=found.rms_norm_percent,
    )


def validity_of(fit: Fit) -> Validity:
    """The range of fields and temperatures in the log."""
    found = fit.figures
    return Validity(
        field_min_ut=_triple(found.field_min_ut),
        field_max_ut=_triple(found.field_max_ut),
        b_max_ut=found.b_max_ut,
        temp_min_c=None if found.temp_c is None else found.temp_c[0],
        temp_max_c=None if found.temp_c is None else found.temp_c[1],
    )


def with_selfcal(calibration: Calibration, run: SelfcalRun, sensor: Sensor) -> Calibration:
    """The calibration with a coil run of the same day as the reference for later power-ups (thesis 6.7).

    Raises InputError when the run does not carry what a reference needs.
    """
    from barberpole.selfcal import factory_reference  # here: selfcal stands on fitted models, as this module does

    reference = factory_reference(run, from_calibration(calibration), sensor.offset_coil_ut_per_ma)
    return replace(calibration, selfcal=reference)


def _triple(values) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return x, y, z
