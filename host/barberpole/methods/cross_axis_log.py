"""The cross-axis search on a log (thesis 5.3)."""

import numpy as np

from barberpole.errors import InputError, must
from barberpole.fit.fit import NOMINAL_MAGNITUDE_UT
from barberpole.log import Log
from barberpole.methods.answer import Answer, Given, Values, matrix_values, per_axis, value
from barberpole.methods.cross_axis import ANISOTROPY_UT, WIDEST, Search, heldout, intervals, require_anisotropy, search
from barberpole.methods.quality import of_the_norm
from barberpole.methods.readings import one_magnitude, scalar
from barberpole.methods.scalar import require_seen
from barberpole.observations import Observations

WHAT = "the cross-axis search"
MOST_ROWS = 6000  # of the grid: enough for three factors, and a search of seconds
LEAST_INTERVALS = 5  # whose peak-to-peak values are summed
LEAST_ROWS = 120  # ten for each of nine parameters and three factors


def cross_axis_search(log: Log, given: Given) -> Answer:
    """alpha, beta, gamma on a log of one field magnitude; the sensor gives H_k and easy axes, else thesis 5.13, 5.3.2.

    Readings of one magnetisation take 5.10-5.12, demodulated ones 5.15-5.17; where the log does not say, both are
    tried and the better one is kept. Raises InputError where the readings do not surround the sensor.
    """
    seen = scalar(log, WHAT)
    otherwise_ut = float(given.reference.get("magnitude_ut", NOMINAL_MAGNITUDE_UT))
    known = one_magnitude(seen, otherwise_ut, WHAT, log.path)
    require_seen(seen, known, log.path)
    hk = np.array(given.sensor.anisotropy_field_ut if given.sensor else ANISOTROPY_UT)
    easy = given.sensor.easy_axis_index if given.sensor else seen.at.easy_axis
    require_anisotropy(hk, known)
    y, first = _chosen(seen, log.path)
    tried = [search(y, known, hk, easy, first, form) for form in _forms(log)]
    best = min(tried, key=lambda found: found.sum_after_ut)
    quality = of_the_norm(best.norm(y) - known, heldout(y, known, first, best), best.shape.upper, known)
    return Answer(_values(best, hk), notes=_notes(best, len(tried)), quality=quality)


def _chosen(seen: Observations, where: object) -> tuple[np.ndarray, np.ndarray]:
    """Readings (3, m) of whole intervals spread over the log, and where each interval starts (k,)."""
    first = intervals(seen.y.shape[1], seen.at.t_s)
    rows = np.split(np.arange(seen.y.shape[1]), first[1:])
    step = -(-seen.y.shape[1] // MOST_ROWS)
    kept = rows[::step]
    count = sum(r.size for r in kept)
    if len(kept) < LEAST_INTERVALS or count < LEAST_ROWS:
        wanted = f"given at least {LEAST_ROWS} rows in {LEAST_INTERVALS} intervals"
        raise InputError(must(WHAT, wanted, f"{count} rows in {len(kept)}", where))
    return seen.y[:, np.concatenate(kept)], np.cumsum([0] + [r.size for r in kept[:-1]])


def _forms(log: Log) -> tuple[bool, ...]:
    """Whether the readings are flipped (demodulated): as the log says, else both."""
    if log.has("x_set_lsb") or (log.has("state") and np.all(log["state"] == 0)):
        return (True,)
    return (False,) if log.has("state") else (False, True)


def _values(found: Search, hk: np.ndarray) -> Values:
    names = ("alpha", "beta", "gamma")
    factors = {n: value(f, np.nan, "1") for n, f in zip(names, found.factors, strict=True)}
    return (
        factors
        | per_axis("cross_field.k", found.factors / hk, np.nan, "1/uT")
        | matrix_values("L", found.shape.upper, None, "uT/LSB")
        | per_axis("b", found.shape.centre, np.nan, "LSB")
        | {
            "peak_to_peak.before": value(found.sum_before_ut, np.nan, "uT"),
            "peak_to_peak.after": value(found.sum_after_ut, np.nan, "uT"),
            "rms.before": value(1000.0 * found.rms_before_ut, np.nan, "nT"),
            "rms.after": value(1000.0 * found.rms_after_ut, np.nan, "nT"),
        }
    )


def _notes(found: Search, tried: int) -> tuple[str, ...]:
    form = "5.15-5.17 (flipped)" if found.flipped else "5.10-5.12 (not flipped)"
    how = "the better of both forms, for want of a column state" if tried > 1 else "as the log says"
    gain = found.rms_before_ut / max(found.rms_after_ut, 1e-300)
    said = (f"readings taken for {form}, {how}", f"residual of the norm {gain:.3g} times smaller")
    if np.max(np.abs(found.factors)) < WIDEST:
        return said
    return (*said, f"a factor beyond {WIDEST:g}, the edge of the grid: H_k is not this, or this is no cross-field")
