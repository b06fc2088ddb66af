"""What is measured. A case makes its data, then what is timed and what tells its error."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from barberpole.board_log import read_board_log
from barberpole.diagnose import diagnose_observations
from barberpole.effects import Conditions
from barberpole.fit.fit import fit_observations
from barberpole.methods.ellipsoid import algebraic, efficient
from barberpole.modelfile import ModelFile
from barberpole.observations import Observations
from barberpole.records import encode, encode_json

from bench.data import FIELD_UT, LADDER, ladder, over_the_bound, turned

LINEAR = ModelFile(("bias", "scale", "misalignment"), {}, {"magnitude_ut": FIELD_UT})
Shape = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Case:
    """what    in the table. n rows. run: timed. error: of its result, with `meaning`.

    Limits, None where there is none: of the time over plain least squares of the same rows, of seconds, of the error.
    """

    what: str
    n: int
    run: Callable[[], Any]
    error: Callable[[Any], float]
    meaning: str
    times: float | None = None
    seconds: float | None = None
    most: float | None = None


def plain(n: int) -> Callable[[], Any]:
    """One plain linear least squares of n rows: the nine columns of a quadric."""
    x, y, z = turned(n, "constant").y
    columns = np.stack([x * x, y * y, z * z, x * y, x * z, y * z, x, y, z], axis=1)
    return lambda: np.linalg.lstsq(columns, np.ones(n), rcond=None)


def by_fit(y: np.ndarray) -> Shape:
    """`fit --model bias,scale,misalignment`."""
    rows = np.arange(y.shape[1])
    seen = Observations(y, Conditions(state=np.zeros(rows.size)), None, None, rows, "constant", False)
    fit = fit_observations(seen, LINEAR)
    at = fit.model.predict(np.hstack([np.zeros((3, 1)), np.eye(3)]), fit.p, Conditions())
    return np.linalg.inv(at[:, 1:] - at[:, :1]), at[:, 0]


def by_efficient(y: np.ndarray) -> Shape:
    """`fit --method ellipsoid`."""
    shape = efficient(y, FIELD_UT)
    return shape.upper, shape.centre


def by_algebra(y: np.ndarray) -> Shape:
    """The closed form alone (thesis 4.19)."""
    shape = algebraic(y, FIELD_UT)
    return shape.upper, shape.centre


def by_navlib(y: np.ndarray) -> Shape:
    """navlib, Fang's constrained least squares; its scale is arbitrary and set here."""
    from navlib.cal.cal_mag import cal_mag_ellipsoid_fit_fang

    centre, soft, field = cal_mag_ellipsoid_fit_fang(y)
    size = float(np.sqrt(np.mean(np.sum(np.reshape(field, (-1, 3)) ** 2, axis=1))))
    return np.linalg.inv(soft) * (FIELD_UT / size), centre


def by_magcc(y: np.ndarray) -> Shape:
    """magcc, Levenberg-Marquardt."""
    from magcc.magcc import calibrate_lm

    centre, soft, *_ = calibrate_lm(y.T, FIELD_UT)
    return soft, centre


def by_mag_cal(y: np.ndarray) -> Shape:
    """circuitpython-mag-cal."""
    from mag_cal.sensor import Sensor

    sensor = Sensor()
    sensor.fit_ellipsoid(y.T)
    return FIELD_UT * sensor.transform, np.ravel(sensor.centre)


ROUTINES = {
    "barberpole fit": (by_fit, 4.0, 1.05),
    "barberpole ellipsoid": (by_efficient, 4.0, 1.05),
    "barberpole closed form": (by_algebra, None, None),
    "navlib 2 Fang": (by_navlib, None, None),
    "magcc LM": (by_magcc, None, None),
    "circuitpython-mag-cal": (by_mag_cal, None, None),
}
DRAWS = {10_000: 40, 200_000: 10}


def ellipsoid(who: str, n: int) -> Case:
    """The nine-parameter ellipsoid; the error is RMS over some draws, with a standard error of 1/sqrt(18 draws)."""
    routine, times, most = ROUTINES[who]
    y = turned(n, "constant").y
    draws = DRAWS[n]

    def error(_: Any) -> float:
        square = [over_the_bound(*routine(turned(n, "constant", s).y), s, n) for s in range(draws)]
        return float(np.sqrt(np.mean(square)))

    limit = None if most is None else most + 2.0 / np.sqrt(18.0 * draws)
    return Case(f"ellipsoid, {who}", n, lambda: routine(y), error, "over Cramér-Rao", times, None, limit)


def vector(n: int, honest: bool = False) -> Case:
    """Twelve parameters with covariance against a known field; `honest`: that which allows for coloured noise too."""
    seen = turned(n, "vector")

    def run() -> Any:
        fit = fit_observations(seen, LINEAR)
        return fit, (fit.covariance if honest else fit.white)

    def apart(found: Any) -> float:
        return abs(found[0].rms_lsb / 0.3 - 1)

    what = "vector, 12 parameters, " + ("honest errors" if honest else "covariance")
    return Case(what, n, run, apart, "rms over noise - 1", None if honest else 2.0)


def full_ladder(n: int = 10_000) -> Case:
    """Temperature, cross-field and converter on top."""
    seen, file = ladder(n), ModelFile(LADDER)

    def chi2(fit: Any) -> float:
        return abs(fit.gram.cost / (seen.y.size - int(fit.free.sum())) - 1.0)

    return Case("ladder, 30 parameters", n, lambda: fit_observations(seen, file), chi2, "chi2/dof - 1", None, 0.3, 0.02)


def diagnosis(n: int, seconds: float | None) -> Case:
    """The whole catalogue; nothing is missing, and nothing must be named."""
    seen = turned(n, "vector")

    def wrong(found: Any) -> float:
        return float(found.verdict == "missing")

    def run() -> Any:
        return diagnose_observations(seen, LINEAR, state_known=False)

    return Case("diagnose, whole catalogue", n, run, wrong, "false alarm", None, seconds, 0.5)


def decoding(n: int = 160_000) -> Case:
    """Board records, 8 rows a frame: at least 20 MB/s."""
    names = [f"{a}_{s}_lsb" for s in ("set", "reset") for a in "xyz"]
    header = {"format": 1, "columns": [[name, "i", 1.0] for name in names] + [["t_s", "d", 1.0]]}
    rows = np.zeros(n, np.dtype([(name, "<i4") for name in names] + [("t_s", "<f8")]))
    for name in names:
        rows[name] = np.random.default_rng(0).integers(-100_000, 100_000, n)
    rows["t_s"] = np.arange(n) / 100.0
    raw, size = rows.tobytes(), rows.itemsize * 8
    frames = [encode("D", 1 + i, raw[i * size : (i + 1) * size]) for i in range(n // 8)]
    data = b"".join([encode_json("H", 0, header), *frames])

    def lost(found: Any) -> float:
        return 1.0 - len(found.columns["t_s"]) / n

    what = f"records, {len(data) / 1e6:.1f} MB"
    return Case(what, n, lambda: read_board_log(data, "bench"), lost, "lost", None, len(data) / 20e6, 0.0)


def cases() -> dict[str, Callable[[], Case]]:
    """All of them by a short name; each is made in a process of its own."""
    made: dict[str, Callable[[], Case]] = {}
    for n in DRAWS:
        for who in ROUTINES:
            made[f"{who} {n}"] = lambda who=who, n=n: ellipsoid(who, n)
        for honest in (False, True):
            made[f"vector {n}" + ", honest" * honest] = lambda n=n, honest=honest: vector(n, honest)
    made["ladder"] = full_ladder
    for n, seconds in ((10_000, None), (100_000, 1.5), (1_000_000, 15.0)):
        made[f"diagnose {n}"] = lambda n=n, seconds=seconds: diagnosis(n, seconds)
    made["records"] = decoding
    return made
