"""Logs that an array would write, by a truth of its own: to try the commands, and to test them.

    y = D (P B + K i + b)      of each sensor: gains, tilted axes, coils that act on their own die, biases        (1)

Four logs: turned through all directions; a coil run; the same after the gains have drifted; and at rest in a gradient.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from barberpole.arrays.array_file import Array
from barberpole.files import write_atomic
from barberpole.log_formats import write_csv

EARTH_UT = (18.0, -6.0, 44.0)
GAIN_LSB_PER_UT, NOISE_LSB = 100.0, 0.5
SPREAD, DRIFT = 0.02, 0.004  # of gains, axes and coils; of the gains until later
COIL_MA, COIL_POINTS, TURNED_ROWS, STILL_ROWS, RATE_HZ = 3.0, 264, 3000, 2000, 50.0
GRADIENT_NT_PER_M = (300.0, -150.0, 80.0)  # along the first baseline


@dataclass(frozen=True)
class Specimen:
    """One sensor of (1): D (3,) LSB/µT, P (3, 3), K (3,) µT/mA, b (3,) µT."""

    gain: np.ndarray
    axes: np.ndarray
    coil: np.ndarray
    bias: np.ndarray

    def reading(self, field_ut: np.ndarray, current_ma: np.ndarray, drift: np.ndarray) -> np.ndarray:
        """(3, n) LSB without noise."""
        inside = self.axes @ field_ut + self.coil[:, None] * current_ma + self.bias[:, None]
        return (self.gain * drift)[:, None] * inside


def simulate(array: Array, folder: Path, seed: int = 0) -> dict[str, np.ndarray]:
    """Write turned.csv, run.csv, later.csv and seen.csv; the drift (3,) of each sensor's gains, which is hidden."""
    rng = np.random.default_rng(seed)
    made = {name: _specimen(array, rng) for name in array.names}
    drift = {name: 1.0 + DRIFT * rng.uniform(-1.0, 1.0, 3) for name in array.names}
    none = {name: np.ones(3) for name in array.names}
    earth = np.asarray(EARTH_UT)[:, None]
    current = COIL_MA * _scattered(COIL_POINTS, rng)
    turned = float(np.linalg.norm(earth)) * _scattered(TURNED_ROWS, rng)
    still = np.repeat(earth, STILL_ROWS, axis=1)
    for name, field_ut, current_ma, today, gradient in (
        ("turned", turned, np.zeros_like(turned), none, np.zeros(3)),
        ("run", np.repeat(earth, COIL_POINTS, axis=1), current, none, np.zeros(3)),
        ("later", np.repeat(earth, COIL_POINTS, axis=1), current, drift, np.zeros(3)),
        ("seen", still, np.zeros_like(still), drift, np.asarray(GRADIENT_NT_PER_M)),
    ):
        fields = _fields(array, field_ut, gradient)
        columns = {"t_s": np.arange(field_ut.shape[1]) / RATE_HZ}
        for sensor, specimen in made.items():
            y = specimen.reading(fields[sensor], current_ma, today[sensor])
            y = y + NOISE_LSB * rng.normal(size=y.shape)
            columns |= {f"{sensor}_{axis}_lsb": y[i] for i, axis in enumerate("xyz")}
        columns |= {f"i{axis}_ma": current_ma[i] for i, axis in enumerate("xyz")}
        write_atomic(folder / f"{name}.csv", write_csv(columns))
    return drift


def _specimen(array: Array, rng: np.random.Generator) -> Specimen:
    coil = array.kind.offset_coil_ut_per_ma
    return Specimen(
        GAIN_LSB_PER_UT * (1.0 + SPREAD * rng.normal(size=3)),
        np.eye(3) + SPREAD * rng.normal(size=(3, 3)),
        coil * (1.0 + SPREAD * rng.normal(size=3)),
        rng.normal(size=3),
    )


def _fields(array: Array, field_ut: np.ndarray, gradient_nt_per_m: np.ndarray) -> dict[str, np.ndarray]:
    """(3, n) at each sensor; it changes along the direction of the first baseline."""
    first, second = array.names[:2]
    along = array.baseline_m(first, second)
    along = along / np.linalg.norm(along)
    far = {name: float(array.baseline_m(first, name) @ along) for name in array.names}
    return {name: field_ut + 1e-3 * d * gradient_nt_per_m[:, None] for name, d in far.items()}


def _scattered(n: int, rng: np.random.Generator) -> np.ndarray:
    """Directions without order, (3, n)."""
    v = rng.normal(size=(3, n))
    return v / np.linalg.norm(v, axis=0)
