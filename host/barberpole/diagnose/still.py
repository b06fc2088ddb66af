"""A sensor that lay still: what its drift may be, and what no such log can tell.

In one orientation the field is a constant vector, so a change of bias and a change of sensitivity are the same
column: dT, and dT times a constant.
"""

from dataclasses import dataclass

import numpy as np

from barberpole.diagnose.patterns import Pattern
from barberpole.errors import InputError
from barberpole.fit.ellipsoid import algebraic
from barberpole.observations import Observations

QUIET = 2.0  # over the noise: what temperature and time leave of a sensor that did not move
DRIFTED = 2.0  # over the noise: drift worth a word
AS_GOOD = 1.1  # ratio of residuals within which two causes are not told apart
HOLLOW = 0.15  # spread of the distance from the centre over that distance; a cloud of noise has 0.4
ONE_WAY = (
    "the sensor lay in one orientation, where a drift of the bias and a drift of the sensitivity look the same: "
    "warm and cool it again in at least two opposite orientations"
)


@dataclass(frozen=True)
class Still:
    """Readings of a sensor at rest: RMS and noise in LSB, causes of the drift that cannot be told apart, patterns."""

    rms_lsb: float
    noise_lsb: float
    causes: tuple[str, ...]
    patterns: tuple[Pattern, ...]
    advice: str


def still(seen: Observations) -> Still | None:
    """What a log without motion says; None if the sensor moved or the log is too short to tell."""
    n = seen.y.shape[1]
    if n < 20 or seen.reference == "vector":
        return None
    y = level(seen)
    if _on_a_closed_surface(y):
        return None
    noise = np.sqrt(np.mean(np.diff(y, axis=1) ** 2, axis=1) / 2.0)
    causes = {name: _left(y, basis) for name, basis in _causes(seen).items()}
    best = min((np.max(left / np.maximum(noise, 1e-300)) for left in causes.values()), default=np.inf)
    total = np.std(y, axis=1)
    if min(best, float(np.max(total / np.maximum(noise, 1e-300)))) > QUIET:
        return None
    rms, floor = float(np.sqrt(np.mean(total**2))), float(np.sqrt(np.mean(noise**2)))
    if rms < DRIFTED * floor:
        return Still(rms, floor, (), (), "the sensor did not move: turn it through all directions")
    return Still(rms, floor, _names(causes), _patterns(y, causes), ONE_WAY)


def level(seen: Observations) -> np.ndarray:
    """Readings (3, n) less the mean of their state: what a bridge's own offset alternates by is no motion."""
    state = np.broadcast_to(np.asarray(seen.at.state, float), seen.y.shape[1:])
    out = seen.y.copy()
    for kind in np.unique(state):
        own = state == kind
        out[:, own] -= out[:, own].mean(axis=1, keepdims=True)
    return out


def _on_a_closed_surface(y: np.ndarray) -> bool:
    """Whether the readings surround a centre at about one distance, as those of a turned sensor do."""
    try:
        shape = algebraic(y)
    except InputError:
        return False
    return float(np.std(np.linalg.norm(shape.field(y), axis=0))) < HOLLOW


def _causes(seen: Observations) -> dict[str, np.ndarray]:
    """Slow covariates (d, n): temperature and time with their squares."""
    found = {"temp_c": seen.at.temp_c, "t_s": seen.at.t_s}
    unit = {k: (v - np.mean(v)) / np.ptp(v) for k, v in found.items() if v is not None and np.ptp(v) > 0}
    return {k: np.stack([np.ones_like(v), v, v * v]) for k, v in unit.items()}


def _left(y: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """RMS (3,) of readings after least squares on a basis."""
    weights = np.linalg.lstsq(basis.T, y.T, rcond=None)[0]
    return np.sqrt(np.mean((y - weights.T @ basis) ** 2, axis=1))


def _names(causes: dict[str, np.ndarray]) -> tuple[str, ...]:
    """Effects that explain the drift as well as the best does."""
    size = {name: float(np.sqrt(np.mean(left**2))) for name, left in causes.items()}
    alike = [name for name, left in size.items() if left <= AS_GOOD * min(size.values())]
    effects = {"temp_c": ("bias_temperature", "sensitivity_temperature"), "t_s": ("drift",)}
    return tuple(effect for name in alike for effect in effects[name])


def _patterns(y: np.ndarray, causes: dict[str, np.ndarray]) -> tuple[Pattern, ...]:
    """Each axis against the covariate that explains it best."""
    against = min(causes, key=lambda name: float(np.sum(causes[name] ** 2)))
    moved = np.sqrt(np.maximum(np.var(y, axis=1) - causes[against] ** 2, 0.0))
    return tuple(Pattern(a, against, "linear", float(m), 1e-300) for a, m in zip("xyz", moved, strict=True))
