"""Between-board variance against estimation variance: what a model of sensor shares, what each board has alone.

A parameter v_b of board b is known to s_b, and the boards of a lot scatter by tau about their mean:
    v_b ~ N(mean, tau^2 + s_b^2),   Q(tau) = sum (v_b - mean)^2 / (tau^2 + s_b^2) ~ chi^2 of B - 1           (1)
Q(0) tests whether the boards differ at all; tau solves Q(tau) = B - 1 (Paule and Mandel 1982), its interval Q at the
quantiles of chi^2. Boards far out are left out, so that tau is that of the lot.

The article finds that sensitivities and noise of one model of sensor agree and may be taken from it, while offset and
misalignment are individual (article 4, conclusion). Whether a difference matters, the readings say: with another
board's value they would be off by tau |J|, J the derivative of the readings, from the fit's own covariance.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats
from scipy.optimize import brentq

from barberpole.errors import InputError, must
from barberpole.fit.fit import MAD

FAR = 5.0  # robust standard deviations: beyond, a board does not count for the lot
DIFFERENT = 0.01  # chance below which boards are said to differ
LEAST = 3  # boards
LEVEL = 0.95  # of intervals
Row = dict[str, Any]


@dataclass(frozen=True)
class Spread:
    """One parameter over the boards of a lot.

    tau, interval   scatter between boards, with its 95 % interval; stderr: the median of the boards' own
    error_lsb       RMS by which the readings are off with another board's value, noise_lsb that of one reading
    """

    name: str
    unit: str
    boards: int
    mean: float
    mean_stderr: float
    tau: float
    interval: tuple[float, float]
    stderr: float
    p_value: float
    error_lsb: float
    noise_lsb: float

    @property
    def kind(self) -> str:
        """common: no difference seen. alike: different by less than the noise of one reading. individual: by more."""
        if self.p_value > DIFFERENT:
            return "common"
        return "alike" if self.error_lsb < self.noise_lsb else "individual"


def spreads(rows: Sequence[Row]) -> list[Spread]:
    """Every parameter that at least three of these fitted rows have. Raises InputError for fewer boards."""
    if len(rows) < LEAST:
        raise InputError(must("the fleet", f"one of at least {LEAST} fitted boards", len(rows)))
    names = dict.fromkeys(name for row in rows for name in row["parameters"])
    return [spread(name, having) for name in names if len(having := _having(name, rows)) >= LEAST]


def _having(name: str, rows: Sequence[Row]) -> list[Row]:
    """The rows in which this parameter and its standard error are numbers."""
    return [row for row in rows if None not in row["parameters"].get(name, [None]) and row["parameters"][name][1] > 0]


def spread(name: str, rows: Sequence[Row]) -> Spread:
    """One parameter over the rows that have it."""
    v, s = np.array([row["parameters"][name] for row in rows]).T
    kept = ~far_out(v, s)
    v, s = v[kept], s[kept]
    tau = between(v, s, v.size - 1.0)
    tail = (1.0 - LEVEL) / 2.0
    ends = [between(v, s, float(stats.chi2.ppf(q, v.size - 1))) for q in (1.0 - tail, tail)]
    weight = 1.0 / (tau**2 + s**2)
    return Spread(
        name,
        rows[0]["units"][name],
        int(v.size),
        float(np.sum(weight * v) / np.sum(weight)),
        float(1.0 / np.sqrt(np.sum(weight))),
        tau,
        (ends[0], ends[1]),
        float(np.median(s)),
        float(stats.chi2.sf(_q(v, s, 0.0), v.size - 1)),
        tau * float(np.median([_slope(row, name) for row in rows])),
        float(np.median([row["rms_lsb"] for row in rows])),
    )


def far_out(v: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Boards whose value lies beyond what lot and standard error explain, both taken robustly."""
    centre = np.median(v)
    tau2 = max((MAD * float(np.median(np.abs(v - centre)))) ** 2 - float(np.median(s)) ** 2, 0.0)
    return np.abs(v - centre) > FAR * np.sqrt(tau2 + s**2)


def between(v: np.ndarray, s: np.ndarray, wanted: float) -> float:
    """tau with Q(tau) = wanted; 0 where the boards scatter by less than that without any."""
    if v.size < 2 or _q(v, s, 0.0) <= wanted:
        return 0.0
    top = float(np.ptp(v)) + float(np.max(s))
    while _q(v, s, top) > wanted:
        top *= 4.0
    found: Any = brentq(lambda tau: _q(v, s, tau) - wanted, 0.0, top, xtol=1e-6 * top)
    return float(found)


def _q(v: np.ndarray, s: np.ndarray, tau: float) -> float:
    weight = 1.0 / (tau**2 + s**2)
    return float(np.sum(weight * (v - np.sum(weight * v) / np.sum(weight)) ** 2))


def _slope(row: Row, name: str) -> float:
    """RMS of d reading / d parameter, LSB per unit: the fit's covariance is sigma^2 (J^T J)^-1 over all residuals."""
    size = len(row["parameters"])
    covariance = np.array(row["covariance"], float).reshape(size, size)
    at = list(row["parameters"]).index(name)
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    information = np.linalg.pinv(covariance / np.outer(scale, scale), hermitian=True)[at, at] / scale[at] ** 2
    readings = row["residuals"] * (3 if row["reference"] == "vector" else 1)
    return row["rms_lsb"] * float(np.sqrt(max(information, 0.0) / readings))
