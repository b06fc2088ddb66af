"""What a log can show of each absent effect, before any of them is fitted.

An effect of its typical size (all axes alike: one filter, one alloy) changes the readings by so many LSB RMS. Two
things may hide it: the model's own parameters, or the reference, take nearly all of it; or what is left of it drowns
in the noise. An effect that may show in one of its forms is visible.
"""

from dataclasses import dataclass

import numpy as np

from barberpole.diagnose.candidates import Absent
from barberpole.diagnose.columns import Candidate
from barberpole.diagnose.evidence import Evidence
from barberpole.diagnose.table import Projection, project

BLIND = 0.1  # of an effect's RMS in the readings left in the residual, 1 % of its power: less cannot be seen
DROWNED = 1.0  # standard errors that the typical size must amount to


@dataclass(frozen=True)
class Visible:
    """left: part of the effect's RMS that survives the model; sigmas: its typical size over its standard error."""

    left: float
    sigmas: float

    @property
    def seen(self) -> bool:
        return self.left >= BLIND and self.sigmas >= DROWNED


def visibility(evidence: Evidence, absent: Absent) -> dict[str, Visible]:
    """Of each absent effect, the form that shows best; of one without a form to try, nothing."""
    in_lsb, out = project(evidence.products.table(), evidence.baseline), {}
    for effect in absent.effects:
        if not effect.loss and effect.name not in evidence.fit.model.effects:
            out[effect.name] = Visible(0.0, 0.0)
    for form, columns in zip(evidence.candidates, evidence.places, strict=True):
        one = _visible(evidence, in_lsb, form, columns)
        best = out[form.effect.name]
        if (one.seen, one.left) > (best.seen, best.left):
            out[form.effect.name] = one
    return out


def _visible(evidence: Evidence, in_lsb: Projection, form: Candidate, columns: np.ndarray) -> Visible:
    if form.shape.secant > 1.0 or form.raw_rms == 0.0:  # a form beyond what real sensors show proves nothing
        return Visible(0.0, 0.0)
    size, at = np.abs(form.typical), np.ix_(columns, columns)
    left = np.sqrt(max(float(size @ in_lsb.matrix[at] @ size), 0.0) / evidence.table.count) / form.raw_rms
    return Visible(float(left), float(np.sqrt(max(float(size @ evidence.projection.matrix[at] @ size), 0.0))))


def unseen(visible: dict[str, Visible]) -> tuple[str, ...]:
    """Names of the effects that this log cannot show."""
    return tuple(name for name, v in visible.items() if not v.seen)
