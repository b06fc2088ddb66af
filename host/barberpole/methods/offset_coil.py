"""Offset-coil calibration and its transfer to the classical one (thesis 6.2, eq. 6.3-6.9).

Driven by its own offset coils in a shield, a sensor shows A and B of H = A h + B (4.5) up to the coils' gains, without
the true off-diagonals. One classical calibration A', B' of the same sensor tells what is missing, once:

    H = (S_c sigma_c) A h + B + B_c                                                  (6.7)
    S_c sigma_c = A' A^-1,   B_c = B' - B                                            (6.8, 6.9)

After that a coil run alone calibrates. (6.7) gives back A' h + B' exactly for the A and B of the first run; A and B in
6.5-6.6 are in the unit of B, gauss, with readings in the same unit.
"""

from dataclasses import dataclass

import numpy as np

from barberpole.calibration import Calibration
from barberpole.errors import InputError, must
from barberpole.fit.usable import require_microtesla
from barberpole.fitted import from_calibration
from barberpole.log import Log
from barberpole.methods.answer import Answer, Given, Values, matrix_values, per_axis, value
from barberpole.methods.linear import heldout, linear_model, require_followed
from barberpole.methods.quality import against_field
from barberpole.methods.readings import demodulated, require_regular
from barberpole.observations import Observations

WHAT = "the offset-coil method"
LINEAR_ONLY = {"bias", "scale", "misalignment", "soft_iron"}
NOMINAL_UT_PER_MA = 21.7  # HMC1021/1022, thesis 6.2.1
FLAT = 1e-3  # smallest over largest coil current that still spans all three coils


@dataclass(frozen=True)
class Affine:
    """H = A h + B (4.5): A (3, 3), B (3,)."""

    a: np.ndarray
    b: np.ndarray

    def field(self, reading: np.ndarray) -> np.ndarray:
        """(3, n) of readings (3, n)."""
        return self.a @ reading + self.b[:, None]


def transfer(coil: Affine, classical: Affine) -> Affine:
    """S_c sigma_c as `a` and B_c as `b`, eq. 6.8-6.9."""
    return Affine(classical.a @ np.linalg.inv(coil.a), classical.b - coil.b)


def transferred(coil: Affine, carried: Affine) -> Affine:
    """A later coil run, brought to the classical calibration by eq. 6.7."""
    return Affine(carried.a @ coil.a, coil.b + carried.b)


def offset_coil(log: Log, given: Given) -> Answer:
    """A and B from a log of coil currents; with `against`, S_c sigma_c and B_c of that calibration.

    Raises InputError without the columns ix_ma.., or where the currents do not span the three coils.
    """
    seen = demodulated(log, WHAT)
    current_ma = require_driven(seen, log.path)
    ut_per_ma = given.sensor.offset_coil_ut_per_ma if given.sensor else NOMINAL_UT_PER_MA
    coil_ut = ut_per_ma * current_ma
    require_microtesla(float(np.max(np.linalg.norm(coil_ut, axis=0))), "the field of the offset coils")
    require_regular(seen.y, coil_ut, log.path)
    found = linear_model(seen.y, coil_ut)
    require_followed(found, seen.y, coil_ut, "the coil currents", log.path)
    coil = Affine(found.matrix, -found.matrix @ found.offset_lsb)
    values = matrix_values("A", coil.a, _stderr(found.covariance)[:, :3], "uT/LSB")
    values |= per_axis("B", coil.b, _stderr(found.covariance)[:, 3], "uT")
    values["coil"] = value(ut_per_ma, np.nan, "uT/mA")
    quality = against_field(found.field(seen.y) - coil_ut, heldout(seen.y, coil_ut), found.matrix)
    if given.against is None:
        notes = ("give --against a classical calibration for S_c sigma_c and B_c (eq. 6.7)",)
        return Answer(values, notes=notes, quality=quality)
    return Answer(values | _carried(transfer(coil, affine_of(given.against))), quality=quality)


def require_driven(seen: Observations, where: object) -> np.ndarray:
    """Coil currents (3, n) in mA. Raises InputError without them, or where they do not span the three coils."""
    if seen.at.i_ma is None:
        raise InputError(must(WHAT, "given the coil currents ix_ma, iy_ma, iz_ma", "a log without them", where))
    size = np.linalg.svd(np.cov(seen.at.i_ma), compute_uv=False)
    if not size[2] > FLAT**2 * size[0]:
        raise InputError(must(WHAT, "given currents in all three coils", "fewer coils driven", where))
    return seen.at.i_ma


def affine_of(calibration: Calibration) -> Affine:
    """A', B' of a calibration whose effects are linear. Raises InputError for others."""
    beyond = [name for name in calibration.model.effects if name not in LINEAR_ONLY]
    if beyond:
        raise InputError(must("the calibration to carry over to", "linear", ", ".join(beyond), calibration.path or ""))
    fitted = from_calibration(calibration)
    corners = np.hstack([np.zeros((3, 1)), np.eye(3)])
    y = fitted.model.predict(corners, fitted.p, fitted.conditions(state=0.0))
    a = np.linalg.inv(y[:, 1:] - y[:, :1])
    return Affine(a, -a @ y[:, 0])


def _carried(carried: Affine) -> Values:
    return matrix_values("Sc_sigma_c", carried.a, None, "1") | per_axis("Bc", carried.b, np.nan, "uT")


def _stderr(covariance: np.ndarray) -> np.ndarray:
    """(3, 4) standard errors of the rows (A | B)."""
    return np.sqrt(np.diag(covariance)).reshape(3, 4)
