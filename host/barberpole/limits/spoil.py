"""Fifteen ways in which a recording goes wrong. Each takes a good one and gives the columns that a user brings."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from barberpole.limits.sensor import GAIN, Columns, Ground, everywhere

READINGS = ("x_lsb", "y_lsb", "z_lsb")
KNOWN_FIELD = ("bx_ut", "by_ut", "bz_ut", "b_ut")
TILT = np.radians(10.0)
MAGNET_UT = 20.0
SPLICED = 0.7  # of the field: indoors after outdoors


@dataclass(frozen=True)
class Case:
    """One kind of bad data. motion: how the sensor is turned; spoil: what then happens to the log's columns."""

    name: str
    motion: Callable[[], np.ndarray] = everywhere
    spoil: Callable[[Columns], Columns] = dict
    units: float = 1.0  # by which every field and current is wrong


def yaw(n: int = 1600) -> np.ndarray:
    """A turn about the vertical in a field that dips 60 degrees."""
    angle = np.linspace(0.0, 6.0 * np.pi, n)
    return np.stack([0.5 * np.cos(angle), -0.5 * np.sin(angle), np.full(n, np.sqrt(0.75))])


def tilted(n: int = 1600) -> np.ndarray:
    """The same with 10 degrees of roll and pitch."""
    angle = np.linspace(0.0, 6.0 * np.pi, n)
    pitch, roll = TILT * np.sin(3.3 * angle), TILT * np.sin(2.1 * angle + 1.0)
    x, y, z = yaw(n)
    x, z = x * np.cos(pitch) - z * np.sin(pitch), x * np.sin(pitch) + z * np.cos(pitch)
    return np.stack([x, y * np.cos(roll) + z * np.sin(roll), z * np.cos(roll) - y * np.sin(roll)])


def still(n: int = 1600) -> np.ndarray:
    return np.repeat(np.array([[0.6], [-0.48], [0.64]]), n, axis=1)


def six() -> np.ndarray:
    return everywhere()[:, ::270]


def one_nan(c: Columns) -> Columns:
    y = c["y_lsb"].copy()
    y[700] = np.nan
    return c | {"y_lsb": y}


def spikes(c: Columns) -> Columns:
    rng = np.random.default_rng(8)
    return c | {a: c[a] + 3000.0 * (rng.random(c[a].size) < 0.005) * rng.choice([-1, 1], c[a].size) for a in READINGS}


def dead(c: Columns) -> Columns:
    return c | {"z_lsb": 30.0 + np.random.default_rng(9).normal(size=c["z_lsb"].size)}


def swapped(c: Columns) -> Columns:
    return c | {"x_lsb": c["y_lsb"], "y_lsb": c["x_lsb"]}


def saturated(c: Columns) -> Columns:
    """The converter ends where a twentieth of an axis' readings lie beyond."""
    return c | {a: np.clip(c[a], *np.quantile(c[a], [0.05, 0.95])) for a in READINGS}


def duplicated(c: Columns) -> Columns:
    return {name: np.repeat(values, 2) for name, values in c.items()}


def shuffled(c: Columns) -> Columns:
    order = np.random.default_rng(10).permutation(c["t_s"].size)
    return {name: values[order] for name, values in c.items()}


def gaps(c: Columns) -> Columns:
    kept = np.random.default_rng(11).random(c["t_s"].size // 40) < 0.7
    rows = np.repeat(kept, 40)
    return {name: values[: rows.size][rows] for name, values in c.items()}


def magnet(c: Columns) -> Columns:
    """Something magnetic passes within 2.5 s: a bump of 20 µT on all axes."""
    at = np.arange(c["t_s"].size)
    bump = GAIN @ np.array([MAGNET_UT, -MAGNET_UT, 0.5 * MAGNET_UT])
    return c | {a: c[a] + b * np.exp(-0.5 * ((at - 900) / 25.0) ** 2) for a, b in zip(READINGS, bump, strict=True)}


def spliced(c: Columns) -> Columns:
    """The second half in another field than the log says."""
    later = np.arange(c["t_s"].size) > 0.55 * c["t_s"].size
    middle = {a: np.mean(c[a]) for a in READINGS}
    return c | {a: np.where(later, middle[a] + SPLICED * (c[a] - middle[a]), c[a]) for a in READINGS}


CASES = (
    Case("good data"),
    Case("one NaN", spoil=one_nan),
    Case("0.5 % spikes", spoil=spikes),
    Case("six samples", motion=six),
    Case("yaw only", motion=yaw),
    Case("±10° tilt", motion=tilted),
    Case("no motion", motion=still),
    Case("one axis dead", spoil=dead),
    Case("swapped axes", spoil=swapped),
    Case("gauss called µT", units=0.01),
    Case("saturated rows", spoil=saturated),
    Case("duplicated rows", spoil=duplicated),
    Case("shuffled time", spoil=shuffled),
    Case("gaps", spoil=gaps),
    Case("a magnet passing by", spoil=magnet),
    Case("two fields spliced", spoil=spliced),
)


def log_of(case: Case, ground: Ground, noise: float, seed: int = 0) -> Columns:
    """The columns that the user brings."""
    columns = case.spoil(ground.log(noise, seed))
    for name in (*KNOWN_FIELD, "ix_ma", "iy_ma", "iz_ma"):
        if name in columns:
            columns[name] = columns[name] * case.units
    return columns
