"""Fit a model to a log: parameters, covariance, what cannot be determined, and the error on stretches left out."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from barberpole.effects import Effect, Setup, find_effect
from barberpole.errors import CoverageError, InputError, must
from barberpole.fit import observability
from barberpole.fit.affine import moments
from barberpole.fit.easy_axes import with_easy_axes
from barberpole.fit.gram import Gram, Tick, heldout_rms
from barberpole.fit.honest import factors
from barberpole.fit.residual import Problem
from barberpole.fit.solve import Measured, Solution, minimise
from barberpole.fit.spikes import no_surface
from barberpole.fit.start import Linear, linear_part, start_values
from barberpole.fit.usable import require_usable
from barberpole.fit.whole import Figures, figures
from barberpole.log import Log
from barberpole.model import Model, compose
from barberpole.modelfile import ModelFile
from barberpole.observations import Observations, as_told, observations

OUTLIER = 4.0  # robust standard deviations; one normal reading in 16 000 lies beyond
MAD = 1.4826  # standard deviation over median absolute deviation of a normal distribution
GIANT = 20.0  # the same at the start of a fit, whose residual is not all noise yet
OUTLIER_PASSES = 4
THIN = 2.0  # residuals: readings this flat follow any surface, and a fit bends it round their noise
NOMINAL_MAGNITUDE_UT = 50.0  # where only its constancy is known; the scale is then relative to it


@dataclass(frozen=True)
class Fit:
    """A fitted model: the problem, the parameters p (P,), their covariance (P, P) in white noise, how well it does.

    rms_lsb over all residuals; heldout_rms_lsb over stretches fitted without them; unobservable: names of parameters
    that this log cannot determine, which stay at their null. held: names of parameters that were not to be fitted.
    whole: where the log was read piece by piece; the problem is then that of a sample of it.
    """

    problem: Problem
    p: np.ndarray
    white: np.ndarray
    gram: Gram
    free: np.ndarray
    converged: bool
    linear: Linear
    setups: dict[str, Setup] = field(default_factory=dict)
    extra: tuple[Effect, ...] = ()
    held: frozenset[str] = frozenset()
    whole: Figures | None = None

    @property
    def model(self) -> Model:
        return self.problem.model

    @cached_property
    def covariance(self) -> np.ndarray:
        """(P, P) of the parameters, wider than `white` where the residual asks for it (`fit.honest`)."""
        wider = factors(self)
        return self.white * np.outer(wider, wider)

    @property
    def stderr(self) -> np.ndarray:
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def unobservable(self) -> tuple[str, ...]:
        return tuple(n for n, f in zip(self.model.names, self.free, strict=True) if not f and n not in self.held)

    @property
    def rms_lsb(self) -> float:
        return self.gram.rms()

    @property
    def heldout_rms_lsb(self) -> float:
        return heldout_rms(self.gram.take(np.flatnonzero(self.free)))

    @property
    def condition(self) -> float:
        """Condition number of the free columns: above 30 the log's geometry hardly carries the model."""
        return self.condition_of(self.free)

    def condition_of(self, columns: np.ndarray) -> float:
        """The same for some of the columns (mask (P,))."""
        return observability.condition(self.gram, columns)

    def field(self) -> np.ndarray:
        """(3, n) µT: each reading taken back through the model."""
        seen = self.problem.seen
        return np.concatenate(
            [self.model.invert(seen.y[:, r], self.p, seen.at.take(r)) for r in self.problem.chunks()], axis=1
        )

    @property
    def n(self) -> int:
        """Samples that were fitted."""
        return self.problem.n if self.whole is None else self.whole.n

    @cached_property
    def figures(self) -> Figures:
        """How well it does on the whole log."""
        return self.whole or figures((self.problem,), self.p)

    def rms_ut(self) -> float:
        """RMS error of the calibrated field: by component against a known field, else of the magnitude."""
        return self.figures.rms_ut

    def rms_norm_percent(self) -> float | None:
        """RMS of |B|/K - 1 in %, for scalar references."""
        return self.figures.rms_norm_percent


def fit_log(log: Log, file: ModelFile, extra: Sequence[Effect] = (), tick: Callable[[int], None] | None = None) -> Fit:
    """Fit the effects of a model file to a log."""
    return fit_observations(observations(log), file, extra, tick)


def fit_observations(seen: Observations, file: ModelFile, extra: Sequence[Effect] = (), tick=None) -> Fit:
    """Fit the effects of a model file to observations. Raises InputError where a column that it needs is not there."""
    require_columns(seen, file.effects, extra)
    seen = with_reference(with_easy_axes(seen) if "cross_field" in file.effects else seen, file)
    magnitude = float(file.reference.get("magnitude_ut", NOMINAL_MAGNITUDE_UT))
    taken = None if seen.b_ut is None else moments(seen.y, seen.b_ut)
    linear = linear_part(seen, magnitude, taken)
    require_usable(seen, linear, magnitude, taken)
    setup = setup_of(seen, linear)
    known = {find_effect(n, extra).name: replace(setup, settings=file.settings.get(n, {})) for n in file.effects}
    model = compose(file.effects, known, extra)
    problem = Problem(model, seen, magnitude, moments=taken)
    return require_any(fit_problem(problem, linear, known, tuple(extra), start_values(model, linear), tick))


def require_any(fit: Fit) -> Fit:
    """The fit. Raises CoverageError where the log determines nothing of the model."""
    if fit.free.any() or not fit.model.names:
        return fit
    wanted = "one that determines a parameter (turn the sensor through all directions)"
    raise CoverageError(must("the log", wanted, f"none of {', '.join(fit.model.names)}"))


def refit(fit: Fit, known: dict[str, Setup], start: dict[str, float], hold: frozenset[str] = frozenset()) -> Fit:
    """The same log under the effects of `known`, from the parameters found so far and those of `start` (by name).

    Parameters of `hold` are not fitted, nor those that were held before.
    """
    model = compose(tuple(known), known, fit.extra)
    values = dict(zip(fit.model.names, fit.p, strict=True)) | start
    p = np.array([values.get(name, first) for name, first in zip(model.names, model.first, strict=True)])
    p = np.clip(p, *model.bounds())
    return fit_problem(replace(fit.problem, model=model), fit.linear, known, fit.extra, p, held=fit.held | hold)


def with_reference(seen: Observations, file: ModelFile) -> Observations:
    """Observations with the model file's reference: of the field and of temperature; time counts from the start of
    the log. Raises InputError where the log knows less of the field."""
    seen = as_told(seen, file.reference.get("kind"))
    start = 0.0 if seen.at.t_s is None else float(seen.at.t_s[0])
    at = replace(seen.at, t0_c=float(file.reference.get("temp_c", seen.at.t0_c)), t0_s=start)
    return replace(seen, at=at)


def setup_of(seen: Observations, linear: Linear, settings: dict | None = None) -> Setup:
    """What an effect may adapt its parameters to."""
    at, t_s = seen.at, seen.at.t_s
    duration = float(t_s[-1] - t_s[0]) if t_s is not None else 0.0
    return Setup(
        settings=settings or {},
        reference=seen.reference,
        flipping=flipping(seen),
        lsb_per_ut=linear.lsb_per_ut or 1.0,
        span_ut=1.5 * linear.span_ut,
        duration_s=duration or float(seen.y.shape[1]),
        interval_s=(duration or float(seen.y.shape[1])) / max(seen.y.shape[1] - 1, 1),
        load_a=_largest(at.load_a),
        current_ma=_largest(at.i_ma),
    )


def _largest(values: np.ndarray | None) -> float:
    """The largest magnitude, or 1 where there is none: only the scale of typical sizes hangs on it."""
    return 1.0 if values is None else float(np.max(np.abs(values), initial=0.0)) or 1.0


def flipping(seen: Observations) -> str:
    """Whether SET and RESET readings are both there, and with which sign RESET came."""
    state = np.asarray(seen.at.state)
    if not (np.any(state > 0) and np.any(state < 0)):
        return "none"
    return "raw" if seen.raw_polarity else "corrected"


def require_columns(seen: Observations, names: Sequence[str], extra: Sequence[Effect] = ()) -> None:
    """Raise InputError if an effect needs what the log does not have."""
    for name in names:
        effect = find_effect(name, extra)
        for column in missing_columns(seen, effect):
            raise InputError(must("the log", f"one with {column}, for effect {effect.name}", "none"))


def missing_columns(seen: Observations, effect: Effect) -> tuple[str, ...]:
    """Columns that an effect requires and the log lacks, as a log names them: `at.i_ma` is its ix_ma, iy_ma, iz_ma."""
    at = seen.at
    held = {"temp_c": at.temp_c, "load_a": at.load_a, "t_s": at.t_s, "i_ma": at.i_ma, "supply_v": at.supply_v}
    lacking = (column for column in effect.requires if held.get(column) is None)
    return tuple("ix_ma..iz_ma" if column == "i_ma" else column for column in lacking)


def fit_problem(
    problem: Problem,
    linear: Linear,
    known: dict[str, Setup],
    extra: tuple[Effect, ...],
    p: np.ndarray,
    tick=None,
    held: frozenset[str] = frozenset(),
) -> Fit:
    """Minimise from p, freezing what the log cannot determine, and leaving outliers out where the model says so.

    Raises InputError where there are too few readings, nothing to fit, or, against a magnitude, where they lie in a
    plane.
    """
    if not problem.model.names:
        got = ", ".join(problem.model.effects)
        raise InputError(must("the model", "one with an effect that has parameters (bias, scale)", got))
    if problem.n * problem.residuals_per_sample <= len(p):
        wanted = f"longer than the model has parameters ({len(p)})"
        raise CoverageError(must("the log", wanted, f"{problem.n * problem.residuals_per_sample} readings"))
    if problem.model.loss is None:
        problem = replace(problem, believed=None)
    elif problem.believed is None:
        problem = replace(problem, believed=believable(problem.residual(p), GIANT))  # else they lead the fit astray
    fitted = np.array([name not in held for name in problem.model.names])
    solution = determined(problem, p, fitted, tick)
    for _ in range(OUTLIER_PASSES if problem.model.loss else 0):
        believed = believable(problem.residual(solution.p))
        if problem.believed is not None and np.array_equal(believed, problem.believed):
            break
        problem = replace(problem, believed=believed)
        solution = determined(problem, solution.p, solution.free, tick)
    if not problem.vector and problem.thinnest < THIN * solution.gram.rms():
        raise CoverageError(no_surface(problem.seen.y))
    s = solution
    return Fit(problem, s.p, s.covariance, s.gram, s.free, s.converged, linear, known, extra, held)


def believable(residual: np.ndarray, limit: float = OUTLIER) -> np.ndarray:
    """Mask (m, n) of residuals within `limit` robust standard deviations of their channel's median."""
    apart = np.abs(residual - np.median(residual, axis=1, keepdims=True))
    return apart <= limit * MAD * np.median(apart, axis=1, keepdims=True)


def _freeze_undetermined(model: Model, solution: Solution, keep: np.ndarray) -> None:
    """Take parameters out of the mask `keep`, the worst first, until all are determined."""
    same = bool(np.array_equal(keep, solution.free))
    covariance = solution.covariance if same else observability.covariance(solution.gram, keep)
    while (worst := observability.undetermined(model, covariance, keep, solution.p)) is not None:
        keep[worst] = False
        covariance = observability.covariance(solution.gram, keep)


def determined(problem: Measured, p: np.ndarray, free: np.ndarray, tick: Tick = None) -> Solution:
    """Minimise from p. Freeze first what is dependent, then what is undetermined, at its null."""
    null = problem.model.null
    # a singular start leads a fit astray
    first = problem.gram(p, 0.0, tick)
    kept = observability.independent(problem.model, first, free)
    free = free & (kept | observability.absent(first))
    while True:
        solution = minimise(problem, p, free, first, tick)
        moved = solution.gram is not first
        keep = observability.independent(problem.model, solution.gram, free) if moved else kept & free
        if solution.converged:  # the covariance says nothing of a fit that went astray
            _freeze_undetermined(problem.model, solution, keep)
        if np.array_equal(keep, free):
            return solution
        p, first = np.where(free & ~keep, null, solution.p), None
        free = keep
