"""The model against the measurement: what is left of the readings, by axis, against everything logged, by frequency
and by direction."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from barberpole.diagnose.curves import Curve, curves
from barberpole.diagnose.evidence import examine
from barberpole.diagnose.ground import Ground
from barberpole.diagnose.patterns import Pattern, patterns
from barberpole.diagnose.whitening import whitening
from barberpole.effects import Effect
from barberpole.fit.fit import Fit
from barberpole.fit.noise import Noise

BANDS = 48  # of the spectrum, logarithmic
MAP = (12, 24)  # of the sphere: bands of equal area in latitude, sectors in longitude


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
    """What is left of the readings under a fit. `noise`: of the sensor at rest, else taken from the residual.

    Of a log that was read piece by piece, patterns, curves, spectrum and sphere are those of a sample of it.
    """
    evidence = examine(fit, None, None, extra)
    ground = evidence.ground
    axes = ground.axes
    noise = evidence.background() if noise is None else noise
    evidence = evidence.under(whitening(noise, fit.problem.n, ground.normal))
    return Comparison(
        n=fit.n,
        rms_lsb=fit.rms_lsb,
        rms_ut=fit.rms_ut(),
        rms_norm_percent=fit.rms_norm_percent(),
        rms_by_axis_lsb=dict(zip(axes, fit.figures.rms_by_channel.tolist(), strict=True)),
        noise_lsb=noise.rms(fit.problem.n),
        patterns=tuple(patterns(evidence)),
        curves=tuple(curves(evidence)),
        spectrum=_spectrum(ground),
        sphere=map_of_sphere(ground.field, ground.residual, ground.axes),
    )


def _spectrum(ground: Ground) -> dict[str, list[float]]:
    """Periodogram in logarithmic bands, LSB^2 a sample."""
    n = ground.residual.shape[1]
    power = np.abs(np.fft.rfft(ground.residual, axis=1)[:, 1:]) ** 2 / n
    edges = np.unique(np.geomspace(1, power.shape[1] + 1, BANDS).astype(int)) - 1
    count = np.diff(edges)
    banded = np.add.reduceat(power[:, : edges[-1]], edges[:-1], axis=1) / count
    f = np.sqrt((edges[:-1] + 1.0) * edges[1:]) / n
    return {"f_per_sample": f.tolist()} | {a: p.tolist() for a, p in zip(ground.axes, banded, strict=True)}


def map_of_sphere(field: np.ndarray, residual: np.ndarray, axes: Sequence[str]) -> dict[str, list[list[float | None]]]:
    """Mean residual (m, n) of each axis by direction of the field (3, n)."""
    x, y, z = field / np.maximum(np.linalg.norm(field, axis=0), 1e-300)
    rows = np.minimum(((z + 1) / 2 * MAP[0]).astype(int), MAP[0] - 1)
    columns = np.minimum(((np.arctan2(y, x) / np.pi + 1) / 2 * MAP[1]).astype(int), MAP[1] - 1)
    cell, cells = rows * MAP[1] + columns, MAP[0] * MAP[1]
    count = np.bincount(cell, minlength=cells)
    maps = {}
    for axis, r in zip(axes, residual, strict=True):
        mean = np.bincount(cell, r, cells) / np.maximum(count, 1)
        filled = [float(m) if c else None for m, c in zip(mean, count, strict=True)]
        maps[axis] = [filled[at : at + MAP[1]] for at in range(0, cells, MAP[1])]
    return maps
