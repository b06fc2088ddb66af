"""What each absent effect would take of one board's residual, small enough to keep: `lots` adds it up over the boards.

For the columns C of an effect, the fitted model's own columns taken off, whitened and in units of the noise,
    u = C^T r,   M = C^T C,   u^T M^-1 u = fall of the sum of squares, chi^2 of rank M without the effect      (1)
and M^-1 u estimates the effect's parameters with covariance M^-1. Forms that were searched for in the residual itself
(a line, a period) are left out: what is picked for its size adds up to a size.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from barberpole.diagnose.candidates import absent_effects
from barberpole.diagnose.evidence import FEW, Evidence, examine
from barberpole.diagnose.table import SEEN
from barberpole.diagnose.whitening import whitening
from barberpole.effects import Effect
from barberpole.fit.fit import Fit
from barberpole.fit.noise import Noise, estimate
from barberpole.modelfile import ModelFile

STANDARD = {"mains": {"frequency_hz": 50.0}}  # where the model file does not say otherwise


def scores(fit: Fit, file: ModelFile, state_known: bool, extra: Sequence[Effect] = ()) -> dict[str, Any]:
    """{"count": residuals, "forms": [{"effect", "form", "settings", "names", "u" (k,), "m" (k k,), "rank"}, ...]}."""
    absent = absent_effects(fit, extra, STANDARD | file.settings, state_known)
    evidence = examine(fit, absent, None, extra)
    evidence = evidence.under(whitening(_noise(evidence), fit.problem.n, evidence.ground.normal))
    projection, numbers, forms = evidence.projection, dict[str, int](), []
    level = projection.rss / projection.freedom
    for form, place in zip(evidence.candidates, evidence.places, strict=True):
        finite = np.all(np.isfinite(projection.matrix[np.ix_(place, np.append(place, -1))]))
        if form.shape.tried > 1 or not finite:
            continue
        name = form.effect.name
        numbers[name] = numbers.get(name, 0) + 1
        u, m, rank = _seen(projection.matrix, projection.energy, place)
        forms.append(
            {
                "effect": name,
                "form": numbers[name],
                "settings": form.shape.settings,
                "names": list(form.names),
                "u": (u / level).tolist(),
                "m": (m / level).ravel().tolist(),
                "rank": rank,
            }
        )
    return {"count": evidence.table.count, "forms": forms}


def _noise(evidence: Evidence) -> Noise:
    """The background; in a log too short to tell, the residual itself: what is sought here is far below the noise."""
    if evidence.table.count >= FEW * evidence.design.count:
        return evidence.background()
    return estimate(evidence.ground.residual, "residual", None, evidence.ground.normal)


def _seen(matrix: np.ndarray, energy: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """u and M of (1) in the directions that survive the model's own columns, and how many these are."""
    size = np.sqrt(np.maximum(energy[place], 1e-300))
    values, vectors = np.linalg.eigh(matrix[np.ix_(place, place)] / np.outer(size, size))
    kept = vectors[:, values > SEEN]
    m = (kept * values[values > SEEN]) @ kept.T * np.outer(size, size)
    return size * (kept @ (kept.T @ (matrix[place, -1] / size))), m, kept.shape[1]
