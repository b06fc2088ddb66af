"""The sensor and the recordings that are spoiled: plain numbers by hand, nothing of the effects under test."""

from dataclasses import dataclass

import numpy as np

from barberpole.challenge import motion

Columns = dict[str, np.ndarray]

ROWS = 1600
FS_HZ = 40.0
FIELD_UT = 50.0
NOISE_LSB = 1.0  # 0.1 µT: what the peers were measured with
GAIN = np.array([[9.6, 0.21, -0.12], [-0.15, 10.2, 0.17], [0.1, -0.2, 10.6]])  # LSB/µT
OFFSET = np.array([120.0, -80.0, 60.0])  # LSB
COIL_UT_PER_MA = 21.7
RESIDUAL_UT = np.array([0.3, -0.2, 0.25])  # of coils switched off
TURNS = {0: (1, 1, 1), 1: (1, -1, -1), 2: (-1, 1, -1), 3: (-1, -1, 1)}


@dataclass(frozen=True)
class Ground:
    """The field (3, n) in µT that the sensor was in, and the columns that a method is told beside the readings."""

    field_ut: np.ndarray
    told: Columns

    def log(self, noise: float = NOISE_LSB, seed: int = 0) -> Columns:
        """Columns of the log, with white noise of so many LSB."""
        rng = np.random.default_rng(seed)
        y = GAIN @ self.field_ut + OFFSET[:, None] + noise * rng.normal(size=self.field_ut.shape)
        return (
            {"t_s": np.arange(y.shape[1]) / FS_HZ} | dict(zip(("x_lsb", "y_lsb", "z_lsb"), y, strict=True)) | self.told
        )


def turned(direction: np.ndarray, told: str) -> Ground:
    """Unit vectors (3, n) in the Earth's field. told: vector, magnitude or constant."""
    n = direction.shape[1]
    size = np.full(n, FIELD_UT)
    if told == "vector":
        size = np.repeat(np.random.default_rng(5).uniform(40.0, 60.0, n // 50 + 1), 50)[:n]
    field = size * direction
    columns: Columns = {}
    if told == "vector":
        columns = dict(zip(("bx_ut", "by_ut", "bz_ut"), field, strict=True))
    elif told == "magnitude":
        columns = {"b_ut": size}
    return Ground(field, columns)


def chambers(direction: np.ndarray) -> Ground:
    """The whole motion again at each of eight temperatures."""
    steps = np.arange(8)
    temp = np.repeat(10.0 + 5.0 * steps, direction.shape[1])
    return Ground(np.tile(FIELD_UT * direction, steps.size), {"temp_c": temp})


def everywhere(n: int = ROWS) -> np.ndarray:
    """(3, n) unit vectors: turned through all directions."""
    return motion.directions(n, np.random.default_rng(3))


def driven(direction: np.ndarray) -> Ground:
    """The offset coils' field in a shield, as currents in mA."""
    current = 2.0 * direction
    return Ground(COIL_UT_PER_MA * current, dict(zip(("ix_ma", "iy_ma", "iz_ma"), current, strict=True)))


def turned_over(n: int = ROWS) -> Ground:
    """At null field, in the four orientations of article 2.4."""
    turn = np.arange(n) * 4 // n
    signs = np.array([TURNS[int(t)] for t in turn]).T
    return Ground(signs * RESIDUAL_UT[:, None], {"turn": turn.astype(float)})
