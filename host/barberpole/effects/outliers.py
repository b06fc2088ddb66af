"""Outliers: a few readings are wrong, and are not to be believed.

    minimise  sum rho(r_k / sigma)   instead of   sum (r_k / sigma)^2                (1)

No law of the sensor makes them (the article saw many from the HMC5983 and few from the LSM303DLHC, section 4), so
there is nothing to simulate or to undo: a reading goes through unchanged. The effect changes how residuals r are
weighed; null is least squares. It is listed last because it acts on the finished reading.
"""

import numpy as np

from barberpole.effects.effect import Conditions, Effect, Setup


def params(setup: Setup):
    """None: the scale sigma of the residuals follows from themselves."""
    return ()


def unchanged(xyz, p, at: Conditions):
    """What came in, LSB."""
    return tuple(xyz)


def jacobian(xyz, p, at: Conditions):
    """Identity, and no parameters."""
    return None, np.zeros((0, 1))


OUTLIERS = Effect(
    "outliers",
    "minimise sum rho(r / sigma)",
    "article section 4; Huber, Robust Statistics (1981)",
    params,
    unchanged,
    unchanged,
    jacobian,
    summary="some readings are simply wrong and must not pull the fit",
    stage="reading",
    loss="robust",
)
