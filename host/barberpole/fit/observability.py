"""What a log can determine: parameters it cannot are named and left at their null, never returned as a number."""

import numpy as np

from barberpole.fit.gram import Gram
from barberpole.model import Model

RANK = 1e-10  # squared sine of the angle to the earlier parameters' columns below which a column adds nothing
USELESS = 3.0  # a standard error this many times the size a real sensor shows says nothing about it
SHOWN = 5.0  # standard errors from its null at which a parameter shows all the same, however noisy the log

BASIC = ("bias", "scale", "misalignment")  # what every sensor has keeps its parameters where others could take them


def independent(model: Model, gram: Gram, free: np.ndarray) -> np.ndarray:
    """Mask of the free parameters whose columns are not combinations of others: basic ones first, then stack order."""
    h = gram.jj.sum(axis=0)
    size = np.sqrt(h.diagonal())
    usable = free & (size > 1e-12 * max(size.max(initial=0.0), 1e-300))
    size = np.where(usable, size, 1.0)
    left = h / (size[:, None] * size)  # the columns' products once those kept so far are taken off
    keep = np.zeros_like(free)
    if usable.all() and np.linalg.eigvalsh(left)[0] > RANK:
        return usable  # no column, in any order, has less left than the smallest eigenvalue
    for j in sorted(np.flatnonzero(usable).tolist(), key=lambda j: model.names[j].split(".")[0] not in BASIC):
        if left[j, j] > RANK:
            keep[j] = True
            left -= left[:, j, None] * (left[j] / left[j, j])
    return keep


def absent(gram: Gram) -> np.ndarray:
    """Mask of the parameters without a column: away from the start it may come to life, as that of a frequency whose
    amplitude is still null."""
    return ~(gram.jj.sum(axis=0).diagonal() > 0)


def covariance(gram: Gram, free: np.ndarray) -> np.ndarray:
    """(P, P) covariance of the parameters; rows of parameters that are not free are zero."""
    h = gram.jj.sum(axis=0)[free][:, free]
    size = np.sqrt(h.diagonal())
    products = size[:, None] * size
    out = np.zeros((free.size, free.size))
    variance = gram.cost / max(gram.count - int(free.sum()), 1)
    out[np.ix_(free, free)] = variance * np.linalg.inv(h / products) / products
    return out


def undetermined(model: Model, covariance: np.ndarray, free: np.ndarray, p: np.ndarray) -> int | None:
    """The free parameter least determined, if its standard error exceeds what a real sensor could show; else None.

    covariance (P, P). One of p (P,) that stands clear of its null is determined, unless it is of the basic ones, which
    hide in each other.
    """
    stderr = np.sqrt(np.maximum(covariance.diagonal(), 0.0))
    typical = np.array([abs(q.typical) if q.typical else np.inf for q in model.params])
    basic = np.array([name.split(".")[0] in BASIC for name in model.names], bool)
    shown = ~basic & (np.abs(p - model.null) > SHOWN * stderr)
    ratio = np.where(free & ~shown, stderr / typical, 0.0)
    worst = int(np.argmax(ratio))
    return worst if ratio[worst] > USELESS else None


def condition(gram: Gram, free: np.ndarray) -> float:
    """Condition number of the free parameters' columns, each brought to unit size."""
    h = gram.jj.sum(axis=0)[np.ix_(free, free)]
    if not h.size:
        return 1.0  # nothing to determine, so nothing to confuse
    size = np.sqrt(h.diagonal())
    values = np.linalg.eigvalsh(h / np.outer(size, size))
    return float(np.sqrt(values[-1] / max(values[0], 1e-300)))
