"""Is this board still what its calibration says? Each check gives a sentence with its figure."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from barberpole.board_log import SelfcalRun
from barberpole.calibration import Calibration
from barberpole.calibration_tables import SelfcalReference
from barberpole.columns import CURRENT
from barberpole.errors import InputError, must
from barberpole.fit.fit import NOMINAL_MAGNITUDE_UT, require_columns
from barberpole.fit.residual import Problem
from barberpole.fit.stream import Streamed
from barberpole.fit.usable import require_microtesla
from barberpole.fitted import Fitted, from_calibration
from barberpole.log import Log
from barberpole.log_stream import LogStream
from barberpole.observations import Observations, as_told, observations
from barberpole.plugins import load_plugins
from barberpole.reasons import sentence
from barberpole.selfcal import SelfcalResult, recompute

FLOAT32_PPM = 10.0  # the board computes in float32; more than this is not rounding
WORSE = 1.5  # a residual this many times the calibration's own is a change, not chance
DRIVEN_MA = 0.1  # of read-back current; less is the offset of its converter
GAIN_DRIFT = 0.05  # of the factory gain, where the board's header does not give its limit


@dataclass(frozen=True)
class Check:
    """One question with its answer."""

    name: str
    ok: bool
    sentence: str
    figures: dict[str, object]


@dataclass(frozen=True)
class Verification:
    """All checks of one log against one calibration."""

    checks: tuple[Check, ...]

    @property
    def passed(self) -> bool:
        return all(check.ok for check in self.checks)

    def to_json(self) -> dict:
        """The object of `verify --json`."""
        figures = {key: value for check in self.checks for key, value in check.figures.items()}
        failed = [check.sentence for check in self.checks if not check.ok]
        return {"pass": self.passed, "reasons": failed, "checks": [c.name for c in self.checks], **figures}


def verify(log: Log, calibration: Calibration, stream: LogStream | None = None) -> Verification:
    """Hold a log against a calibration. `stream`: of a long log, of which `log` is then a sample.

    Raises InputError if the board ran another model, or nothing can be checked.
    """
    fitted = from_calibration(calibration)
    checks = [*_identity(log, calibration), *_selfcal(log, calibration, fitted)]
    if not coils_driven(log):
        checks += _readings(log, calibration, fitted, stream)
    if not checks:
        wanted = "one with the offset coils at rest, or a board's own record of a power-up"
        got = "currents in ix_ma..iz_ma, and no verdict of a board's own run"
        raise InputError(must("the log", wanted, got, log.path))
    return Verification(tuple(checks))


def _identity(log: Log, calibration: Calibration) -> Iterator[Check]:
    model, running = log.meta.get("model"), log.meta.get("calibration")
    if model and model != calibration.model.hash:
        raise InputError(must("the board's model", calibration.model.hash, model, log.path))
    if running:
        yield Check(
            "calibration",
            running == calibration.hash,
            f"The board runs calibration {running}; this file is {calibration.hash}.",
            {"calibration": calibration.hash, "running": running},
        )


def _selfcal(log: Log, calibration: Calibration, fitted: Fitted) -> Iterator[Check]:
    result = log.meta.get("result")
    if result is None:
        return
    accepted, codes = bool(result.get("accepted")), list(result.get("reasons", []))
    yield Check(
        "selfcal",
        accepted,
        "The board accepted its self-calibration." if accepted else f"The board refused its run: {sentence(codes)}",
        {"selfcal_accepted": accepted, "selfcal_reasons": codes, "in_force": result.get("in_force")},
    )
    if log.selfcal is not None and calibration.selfcal is not None:
        again = recompute(log.selfcal, fitted, factory_response(log.selfcal, calibration.selfcal))
        yield from _gains(result, again)


def factory_response(run: SelfcalRun, reference: SelfcalReference) -> np.ndarray:
    """(3, 3) µT per unit of this run's currents, which need not be the factory's."""
    response = np.asarray(reference.gain_ut_per_unit)
    today_ma = run.header.get("unit_ma")
    return response if today_ma is None else response * (np.asarray(today_ma) / np.asarray(reference.units_ma))


def _gains(result: dict, again: SelfcalResult) -> Iterator[Check]:
    drift = float(np.max(np.abs(again.gain - 1.0)))
    yield Check(
        "gain_drift",
        drift <= GAIN_DRIFT,
        f"The gains are within {100 * drift:.3f} % of the factory's; {100 * GAIN_DRIFT:.0f} % is allowed.",
        {"gain": again.gain.tolist(), "gain_drift": drift},
    )
    if result.get("accepted") and "gain" in result:
        ppm = float(np.max(np.abs(np.asarray(result["gain"]) / again.gain - 1.0)) * 1e6)
        yield Check(
            "float32",
            ppm <= FLOAT32_PPM,
            f"Board (float32) and host (double) agree within {ppm:.2f} ppm on the same points.",
            {"board_against_host_ppm": ppm},
        )


def coils_driven(log: Log) -> bool:
    """Whether the rows are points of a coil run, whose field is not the ambient one."""
    currents = log.stack(CURRENT)
    return currents is not None and bool(np.max(np.abs(currents)) > DRIVEN_MA)


def _readings(log: Log, calibration: Calibration, fitted: Fitted, stream: LogStream | None) -> Iterator[Check]:
    told = as_told(observations(log), calibration.model.reference.get("kind"))
    seen = _with_sensor(told, fitted, log)
    require_columns(seen, fitted.model.effects, load_plugins(calibration.model.plugins))
    magnitude = float(calibration.model.reference.get("magnitude_ut", NOMINAL_MAGNITUDE_UT))
    known = seen.b_mag if seen.b_ut is None else np.linalg.norm(seen.b_ut, axis=0)
    if known is not None:
        require_microtesla(float(np.max(known)))  # a log in another unit tells nothing of the board
    problem = Problem(fitted.model, seen, magnitude)
    problems = (problem,) if stream is None else Streamed(stream, problem).problems()
    if problem.vector:
        yield _against_field(problems, fitted, calibration)
    else:
        yield _against_norm(problems, fitted, calibration)


def _with_sensor(seen: Observations, fitted: Fitted, log: Log) -> Observations:
    """Observations under this sensor's conditions, with the gains in force on the board."""
    # the parameters say which readings they were fitted to; a demodulated log then sees nothing of what alternates
    known = fitted.conditions(gain=gains_in_force(log))
    at = replace(
        seen.at,
        easy_axis=known.easy_axis,
        t0_c=known.t0_c,
        gain=known.gain,
        raw_polarity=known.raw_polarity,
    )
    return replace(seen, at=at)


def gains_in_force(log: Log) -> tuple[float, float, float]:
    """Today's gains over the factory's, as the board compensates with them; 1 without a self-calibration."""
    x, y, z = (log.meta.get("result") or {}).get("in_force_gain") or (1.0, 1.0, 1.0)
    return float(x), float(y), float(z)


def _against_field(problems: Iterable[Problem], fitted: Fitted, calibration: Calibration) -> Check:
    total, count = 0.0, 0
    for problem in problems:
        for rows in problem.chunks():
            residual = problem.residual_of(fitted.p, rows)
            total, count = total + float(np.vdot(residual, residual)), count + residual.size
    rms = float(np.sqrt(total / count))
    before = calibration.residual.rms_lsb
    return Check(
        "residual",
        rms <= WORSE * before,
        f"The residual is {rms:.4g} LSB; the calibration left {before:.4g} LSB, {WORSE:g} times that is allowed.",
        {"rms_lsb": rms, "calibration_rms_lsb": before},
    )


def _against_norm(problems: Iterable[Problem], fitted: Fitted, calibration: Calibration) -> Check:
    percent, mean_ut = _scatter(problems, fitted)
    before = _norm_percent(calibration)
    return Check(
        "norm",
        percent <= WORSE * before,
        f"|B| scatters by {percent:.3g} % about its mean; the calibration left {before:.3g} %, "
        f"{WORSE:g} times that is allowed.",
        {"rms_norm_percent": percent, "calibration_norm_percent": before, "mean_norm_ut": mean_ut},
    )


def _scatter(problems: Iterable[Problem], fitted: Fitted) -> tuple[float, float]:
    """RMS of |B|/K - 1 in %, K being the magnitude logged or else the mean, and the mean of |B| in µT."""
    n, apart, apart2, relative2, reference, known = 0, 0.0, 0.0, 0.0, 0.0, False
    for problem in problems:
        seen, reference, known = problem.seen, problem.magnitude_ut, problem.seen.b_mag is not None
        for rows in problem.chunks():
            norm = np.linalg.norm(fitted.model.invert(seen.y[:, rows], fitted.p, seen.at.take(rows)), axis=0)
            n += norm.size
            apart, apart2 = apart + float(np.sum(norm - reference)), apart2 + float(np.sum((norm - reference) ** 2))
            relative2 += float(np.sum((norm / problem.magnitude(rows) - 1.0) ** 2))
    mean = reference + apart / n
    scatter = relative2 / n if known else max(apart2 / n - (apart / n) ** 2, 0.0) / mean**2
    return float(100.0 * np.sqrt(scatter)), mean


def _norm_percent(calibration: Calibration) -> float:
    """What the calibration left in the norm, in %; from a vector fit, its error over the field it saw."""
    residual = calibration.residual
    if residual.rms_norm_percent is not None:
        return residual.rms_norm_percent
    if residual.rms_ut is None or not calibration.validity.b_max_ut:
        raise InputError(must("the calibration", "one with a residual in µT or in % of the norm", "neither"))
    return 100.0 * residual.rms_ut / calibration.validity.b_max_ut
