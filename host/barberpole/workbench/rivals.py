"""Two models side by side, on stretches of the log that neither was fitted to."""

from dataclasses import dataclass

import numpy as np

from barberpole.fit.gram import FOLDS, by_fold
from barberpole.workbench.bench import Bench
from barberpole.workbench.lab import Lab


@dataclass(frozen=True)
class Comparison:
    """Held-out errors in LSB by fold (FOLDS,) of one model and the other; sigmas: of their mean paired difference."""

    one: tuple[float, ...]
    other: tuple[float, ...]
    sigmas: float

    @property
    def sentence(self) -> str:
        """Which is better, and whether that is sure."""
        a, b = (float(np.sqrt(np.mean(np.square(v)))) for v in (self.one, self.other))
        better = "the first" if a < b else "the second"
        said = f"{a:.4g} against {b:.4g} LSB on held-out stretches"
        if not abs(self.sigmas) > SURE:
            return f"{said}: no sure difference ({abs(self.sigmas):.2g} standard errors)"
        return f"{said}: {better} is better, by {abs(self.sigmas):.2g} standard errors"


SURE = 2.0


def rivals(lab: Lab, one: Bench, other: Bench) -> Comparison:
    """Compare two benches of the same rows."""
    a, b = (np.array(_by_fold(lab, bench)) for bench in (one, other))
    difference = a**2 - b**2
    error = float(np.std(difference, ddof=1) / np.sqrt(FOLDS))
    return Comparison(tuple(a.tolist()), tuple(b.tolist()), float(np.mean(difference)) / max(error, 1e-300))


def _by_fold(lab: Lab, bench: Bench) -> list[float]:
    """RMS of each fold under the parameters fitted to the others, as `heldout_rms` takes them together."""
    fit = lab.fit(bench)
    folds = by_fold(fit.gram.take(np.flatnonzero(fit.free)))
    return [float(np.sqrt(square / max(count, 1.0))) for square, count in folds]
