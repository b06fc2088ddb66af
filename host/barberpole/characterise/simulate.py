"""Readings of a digital sensor as its file describes the kind: article table 1 as a simulation.

    y = round((W S(T))^-1 B + offset + noise)

W has the median misalignment between all axes, S(T) the sensitivity with its drift formula; offset and drift of the
offset are drawn from the ranges over sensors: one seed, one sensor. The noise is white plus 1/f, of the standard
deviation and the density at 1 Hz that the file gives, over the article's five minutes.
"""

import numpy as np

from barberpole.errors import InputError, must
from barberpole.sensor import Digital, Sensor

RECORD_S = 300.0  # article 2.4: length of a noise measurement
T0_C = 25.0


def white_and_corner(std: float, at_1_hz: float, rate_hz: float, record_s: float = RECORD_S) -> tuple[float, float]:
    """White density w and corner c in Hz of w² (1 + c/f) with this density at 1 Hz and this variance over the band.

        std² = w² (h + c ln(h T)),   at_1_hz² = w² (1 + c),   h = rate / 2, T the record

    Where the density at 1 Hz is that of white noise or less, the noise is white.
    """
    half = 0.5 * rate_hz
    variance, density = std**2, at_1_hz**2
    corner = (half * density - variance) / (variance - density * np.log(half * record_s))
    if not (half * density > variance and corner > 0):
        return float(std / np.sqrt(half)), 0.0
    return float(at_1_hz / np.sqrt(1.0 + corner)), float(corner)


def noise(digital: Digital, n: int, rng: np.random.Generator) -> np.ndarray:
    """(3, n) nT of noise, drawn by shaping a spectrum."""
    f = np.maximum(np.fft.rfftfreq(n, 1.0 / digital.rate_hz), 0.5 * digital.rate_hz / n)
    out = np.empty((3, n))
    for i in range(3):
        white, corner = white_and_corner(digital.noise_nt[i], digital.noise_at_1_hz_nt_per_rthz[i], digital.rate_hz)
        shape = white * np.sqrt(0.5 * digital.rate_hz * (1.0 + corner / f))
        out[i] = np.fft.irfft(np.fft.rfft(rng.normal(size=n)) * shape, n)
    return out


def readings(sensor: Sensor, field_ut: np.ndarray, temp_c: float = T0_C, seed: int = 0) -> np.ndarray:
    """(3, n) whole counts of one sensor of this kind in fields (3, n) in µT, at the file's rate.

    Raises InputError for a sensor without converter on the chip, or fields beyond its range.
    """
    digital = sensor.digital
    if digital is None:
        raise InputError(must("the sensor to simulate", "one with a table [sensor.digital]", sensor.name))
    largest = float(np.max(np.abs(field_ut), initial=0.0))
    if largest > sensor.range_ut:
        raise InputError(must("the field", f"within ±{sensor.range_ut:g} µT of {sensor.name}", f"{largest:g} µT"))
    rng = np.random.default_rng(seed)
    offset_nt = rng.uniform(*digital.offset_nt, 3)
    middle, half = digital.offset_drift_nt_per_c
    offset_nt = offset_nt + rng.uniform(middle - half, middle + half, 3) * (temp_c - T0_C)
    felt = np.linalg.solve(_misaligned(digital), 1000.0 * field_ut)
    y = (felt + noise(digital, field_ut.shape[1], rng)) / sensitivity_nt(digital, temp_c)[:, None]
    return np.round(y + (offset_nt / np.array(digital.sensitivity_nt_per_lsb))[:, None])


def sensitivity_nt(digital: Digital, temp_c: float) -> np.ndarray:
    """(3,) nT/LSB at a temperature, by the drift formula from 25 °C."""
    slope, level = digital.sensitivity_drift_formula
    change_pt = 0.5 * slope * (temp_c**2 - T0_C**2) + level * (temp_c - T0_C)
    return np.array(digital.sensitivity_nt_per_lsb) + 1e-3 * change_pt


def _misaligned(digital: Digital) -> np.ndarray:
    """W of article eq. 3 (3, 3): unit columns, every two at 90° plus the median misalignment."""
    cosine = -np.sin(np.radians(digital.misalignment_deg[0]))
    return np.linalg.cholesky(np.full((3, 3), cosine) + (1.0 - cosine) * np.eye(3)).T
