"""The model against the measurement: what is left of the readings, by axis, against everything logged, by frequency
and by direction."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from barberpole.diagnose.covariates import covariates
from barberpole.diagnose.evidence import examine
from barberpole.diagnose.ground import Ground
from barberpole.diagnose.noise import Noise
from barberpole.diagnose.patterns import Pattern, patterns
from barberpole.diagnose.whitening import whitening
from barberpole.effects import Effect
from barberpole.fit.fit import Fit

BINS = 20  # of a covariate, each with as many samples
BANDS = 48  # of the spectrum, logarithmic
MAP = (12, 24)  # of the sphere: bands of equal area in latitude, sectors in longitude


@dataclass(frozen=True)
class Curve:
    """Mean residual (LSB) of one axis in bins of a covariate, with its standard error under the noise found."""

    axis: str
    against: str
    x: list[float]
    mean_lsb: list[float]
    error_lsb: list[float]


@dataclass(frozen=True)
class Comparison:
    """Residual RMS by axis and together; patterns, strongest first; curves; spectrum {f_per_sample, axis: LSB^2};
    sphere: mean residual (LSB) of each axis by latitude band and longitude sector, None where nothing was."""

    n: int
    rms_lsb: float
    rms_ut: float
    rms_norm_percent: float | None
    rms_by_axis_lsb: dict[str, float]
    noise_lsb: float
    patterns: tuple[Pattern, ...]
    curves: tuple[Curve, ...]
    spectrum: dict[str, list[float]]
    sphere: dict[str, list[list[float | None]]]

    def to_json(self) -> dict[str, Any]:
        """Plain numbers, strings, lists and dictionaries."""
        return vars(self) | {
            "patterns": [asdict(p) for p in self.patterns],
            "curves": [asdict(c) for c in self.curves],
        }


def compare(fit: Fit, noise: Noise | None = None, extra: Sequence[Effect] = ()) -> Comparison:
    """What is left of the readings under a fit. `noise`: of the sensor at rest, else taken from the residual."""
    evidence = examine(fit, None, None, extra)
    ground = evidence.ground
    axes = axes_of(ground)
    noise = evidence.background() if noise is None else noise
    white = whitening(noise, fit.problem.n, ground.normal)
    return Comparison(
        n=fit.problem.n,
        rms_lsb=fit.rms_lsb,
        rms_ut=fit.rms_ut(),
        rms_norm_percent=fit.rms_norm_percent(),
        rms_by_axis_lsb={a: float(np.sqrt(np.mean(r**2))) for a, r in zip(axes, ground.residual, strict=True)},
        noise_lsb=noise.rms(fit.problem.n),
        patterns=tuple(patterns(evidence.under(white))),
        curves=tuple(_curves(ground, noise)),
        spectrum=_spectrum(ground),
        sphere=_sphere(ground),
    )


def axes_of(ground: Ground) -> tuple[str, ...]:
    """Names of the residual channels."""
    return ("x", "y", "z") if ground.residual.shape[0] == 3 else ("norm",)


def _curves(ground: Ground, noise: Noise) -> list[Curve]:
    seen, out = ground.fit.problem.seen, []
    for covariate in covariates(seen, ground.field):
        if covariate.shapes[0] == "product" and len(covariate.basis) > 1:
            continue
        values = _in_its_unit(covariate.name, covariate.basis[0], ground)
        for axis, r in zip(axes_of(ground), ground.residual, strict=True):
            out.append(_curve(axis, covariate.name, values, r, noise))
    return out


def _in_its_unit(name: str, basis: np.ndarray, ground: Ground) -> np.ndarray:
    """The covariate as logged, where the basis was scaled."""
    at = ground.fit.problem.seen.at
    logged = {"t_s": at.t_s, "temp_c": at.temp_c, "load_a": at.load_a}
    logged |= {f"field_{a}": ground.field[i] for i, a in enumerate("xyz")}
    logged |= {f"i{a}_ma": at.i_ma[i] for i, a in enumerate("xyz")} if at.i_ma is not None else {}
    value = logged.get(name)
    return basis if value is None else np.broadcast_to(np.asarray(value, float), basis.shape)


def _curve(axis: str, against: str, values: np.ndarray, residual: np.ndarray, noise: Noise) -> Curve:
    edges = np.unique(np.quantile(values, np.linspace(0, 1, BINS + 1)))
    bins = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, max(len(edges) - 2, 0))
    count = np.maximum(np.bincount(bins), 1)
    mean = np.bincount(bins, residual) / count
    error = _independent(noise) * np.sqrt(np.bincount(bins, residual**2) / count - mean**2) / np.sqrt(count)
    return Curve(axis, against, (np.bincount(bins, values) / count).tolist(), mean.tolist(), error.tolist())


def _independent(noise: Noise, span: int = 100) -> float:
    """By how much correlated noise enlarges the error of a mean of `span` samples."""
    return float(np.sqrt(noise.shape(np.array([1.0 / span]))[0]))


def _spectrum(ground: Ground) -> dict[str, list[float]]:
    """Periodogram in logarithmic bands, LSB^2 a sample."""
    n = ground.residual.shape[1]
    power = np.abs(np.fft.rfft(ground.residual, axis=1)[:, 1:]) ** 2 / n
    edges = np.unique(np.geomspace(1, power.shape[1] + 1, BANDS).astype(int)) - 1
    count = np.diff(edges)
    banded = np.add.reduceat(power[:, : edges[-1]], edges[:-1], axis=1) / count
    f = np.sqrt((edges[:-1] + 1.0) * edges[1:]) / n
    return {"f_per_sample": f.tolist()} | {a: p.tolist() for a, p in zip(axes_of(ground), banded, strict=True)}


def _sphere(ground: Ground) -> dict[str, list[list[float | None]]]:
    """Mean residual by direction of the field."""
    x, y, z = ground.field / np.maximum(np.linalg.norm(ground.field, axis=0), 1e-300)
    rows = np.minimum(((z + 1) / 2 * MAP[0]).astype(int), MAP[0] - 1)
    columns = np.minimum(((np.arctan2(y, x) / np.pi + 1) / 2 * MAP[1]).astype(int), MAP[1] - 1)
    cell, cells = rows * MAP[1] + columns, MAP[0] * MAP[1]
    count = np.bincount(cell, minlength=cells)
    maps = {}
    for axis, r in zip(axes_of(ground), ground.residual, strict=True):
        mean = np.bincount(cell, r, cells) / np.maximum(count, 1)
        filled = [float(m) if c else None for m, c in zip(mean, count, strict=True)]
        maps[axis] = [filled[at : at + MAP[1]] for at in range(0, cells, MAP[1])]
    return maps
