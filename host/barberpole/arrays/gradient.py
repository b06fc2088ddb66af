"""What an array says beside its fields: the gradient along each baseline (thesis 1.2, 6.2).

    g = (H_2 - H_1) / |d|,  d the baseline from sensor 1 to sensor 2                                              (1)

(3,) for each pair: how much each component changes per metre along d, in nT/m.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from barberpole.arrays.array_file import Array
from barberpole.units import ut_to_nt


@dataclass(frozen=True)
class Gradient:
    """Of one pair of neighbours: baseline_m its length, direction (3,) of it; nt_per_m (3, n)."""

    first: str
    second: str
    baseline_m: float
    direction: np.ndarray
    nt_per_m: np.ndarray

    @property
    def mean(self) -> np.ndarray:
        """(3,) nT/m."""
        return self.nt_per_m.mean(axis=1)

    @property
    def rms_change(self) -> np.ndarray:
        """(3,) nT/m: deviation of single rows; while nothing moves it is the noise, else what is left of alignment."""
        return self.nt_per_m.std(axis=1)


def gradients(array: Array, fields: dict[str, np.ndarray]) -> list[Gradient]:
    """(1) of neighbours in the order of the file, from fields (3, n) in µT."""
    found = []
    for first, second in pairwise(array.names):
        d = array.baseline_m(first, second)
        length = float(np.linalg.norm(d))
        apart = np.asarray(ut_to_nt(1.0)) * (fields[second] - fields[first]) / length
        found.append(Gradient(first, second, length, d / length, apart))
    return found
