"""A hand rotation guided by what the parameters still lack, and not by a percentage of the sphere.

A sensor turned in a field of constant magnitude K determines bias b (3) and a symmetric matrix M (6) by

    |B| = K + u^T M u K - u^T b,        u the direction of the field in the sensor                   (1)

so a reading in direction u adds j j^T / sigma^2 to the Fisher information, j = d|B| / d(b, M). Its inverse bounds
the covariance C of any unbiased fit (Cramér-Rao). The error of a calibrated field K u is then at best

    e(u)^2 = trace A(u) C A(u)^T,       A(u) (b, M) = M K u - b                                        (2)

Enough is when the largest e(u) is below what was asked for. The best next direction is that in which (1) is least
certain, j^T C j at its largest (a G-optimal design). Readings of one direction are not independent: their low-frequency
noise is common, so that a cell of the sphere counts CELL_MOST times at most.
"""

from dataclasses import dataclass, field

import numpy as np

from barberpole.figures.sphere import BANDS, SECTORS, direction_counts

CELL_MOST = 20
PRIOR_BIAS_UT = 100.0  # before any reading: nothing is known of the bias,
PRIOR_MATRIX = 0.3  # nor of gains and angles
WANTED = 1e-3  # of K: a tenth of a percent


def _centres() -> np.ndarray:
    """(3, cells) unit vectors of the cells."""
    up = (np.arange(BANDS) + 0.5) * 2 / BANDS - 1
    turn = np.radians((np.arange(SECTORS) + 0.5) * 360 / SECTORS - 180)
    z, phi = np.repeat(up, SECTORS), np.tile(turn, BANDS)
    level = np.sqrt(1 - z * z)
    return np.stack([level * np.cos(phi), level * np.sin(phi), z])


U = _centres()


@dataclass
class Coverage:
    """Readings by direction, their mean magnitude, and the noise of the magnitude; of fixed size whatever comes."""

    counts: np.ndarray = field(default_factory=lambda: np.zeros((BANDS, SECTORS), int))
    total: int = 0
    sum_ut: float = 0.0
    steps: int = 0
    step_sum: float = 0.0
    last: np.ndarray | None = None

    def add(self, field_ut: np.ndarray) -> None:
        """More readings (3, n) in µT; those that are not numbers are left out."""
        field_ut = field_ut[:, np.all(np.isfinite(field_ut), axis=0)]
        if not field_ut.shape[1]:
            return
        self.counts += direction_counts(field_ut)
        norm = np.linalg.norm(field_ut, axis=0)
        self.total += norm.size
        self.sum_ut += float(norm.sum())
        self.steps += norm.size - 1
        self.step_sum += float(np.sum(np.diff(norm) ** 2))
        self.last = field_ut[:, -1]

    def copy(self) -> "Coverage":
        return Coverage(self.counts.copy(), self.total, self.sum_ut, self.steps, self.step_sum, self.last)

    @property
    def magnitude_ut(self) -> float:
        """K, the mean so far."""
        return self.sum_ut / max(self.total, 1)

    @property
    def noise_ut(self) -> float:
        """Of one reading of |B|, from the steps between neighbours."""
        return float(np.sqrt(self.step_sum / max(self.steps, 1) / 2)) or 1e-3


@dataclass(frozen=True)
class Bound:
    """What the readings so far allow. error_ut: (2) in each cell (BANDS, SECTORS); next: the cell to turn to."""

    error_ut: np.ndarray
    wanted_ut: float
    next: tuple[int, int]
    bias_ut: float
    matrix: float

    @property
    def worst_ut(self) -> float:
        return float(self.error_ut.max())

    @property
    def enough(self) -> bool:
        return self.worst_ut <= self.wanted_ut

    @property
    def sentence(self) -> str:
        """What to do, in words."""
        figure = f"{self.worst_ut * 1e3:.3g} nT in the worst direction, wanted {self.wanted_ut * 1e3:.3g} nT"
        if self.enough:
            return f"Enough: the parameters allow {figure}."
        return f"Not yet: the parameters allow {figure}. Turn until the field points along {words(self.next)}."


def bound(coverage: Coverage, wanted_ut: float | None = None) -> Bound:
    """The Cramér-Rao bound of (b, M) after these readings. Without readings the prior is all there is."""
    k = coverage.magnitude_ut or 50.0
    weight = np.minimum(coverage.counts, CELL_MOST).ravel() / coverage.noise_ut**2
    j = _slopes(k)
    prior = np.diag([PRIOR_BIAS_UT**-2] * 3 + [PRIOR_MATRIX**-2] * 6)
    c = np.linalg.inv(prior + (j * weight) @ j.T)
    a = _field_slopes(k)
    error = np.sqrt(np.einsum("rpn,pq,rqn->n", a, c, a))
    uncertain = np.einsum("pn,pq,qn->n", j, c, j)
    uncertain[np.minimum(coverage.counts, CELL_MOST).ravel() == CELL_MOST] = 0.0
    best = np.unravel_index(int(np.argmax(uncertain)), (BANDS, SECTORS))
    stderr = np.sqrt(np.diag(c))
    return Bound(
        error.reshape(BANDS, SECTORS),
        WANTED * k if wanted_ut is None else wanted_ut,
        (int(best[0]), int(best[1])),
        float(stderr[:3].max()),
        float(stderr[3:].max()),
    )


def _slopes(k: float) -> np.ndarray:
    """(9, cells): d|B| / d(b, M) of (1)."""
    x, y, z = U
    return np.stack([-x, -y, -z, k * x * x, k * y * y, k * z * z, 2 * k * x * y, 2 * k * x * z, 2 * k * y * z])


def _field_slopes(k: float) -> np.ndarray:
    """(3, 9, cells): A(u) of (2)."""
    x, y, z = k * U
    zero, one = np.zeros_like(x), np.ones_like(x)
    return np.stack(
        [
            np.stack([-one, zero, zero, x, zero, zero, y, z, zero]),
            np.stack([zero, -one, zero, zero, y, zero, x, zero, z]),
            np.stack([zero, zero, -one, zero, zero, z, zero, x, y]),
        ]
    )


def words(cell: tuple[int, int]) -> str:
    """A direction for a hand: the sensor axes that it lies along, the strongest first."""
    u = U[:, cell[0] * SECTORS + cell[1]]
    order = np.argsort(-np.abs(u))
    named = [f"{'+' if u[i] > 0 else '−'}{'xyz'[i]}" for i in order if abs(u[i]) > 0.35]
    return " and ".join(named[:2]) if len(named) > 1 else named[0]
