"""The Earth's field at a place and date, from the IGRF through ppigrf.

Latitude and longitude are geodetic, in degrees, north and east positive; the height in km is above the ellipsoid.
`geomagnetic_magnitude_ut` is the K of the scalar calibration (thesis 4.13) where nobody measured it.
"""

from datetime import date, datetime

import numpy as np
import ppigrf

from barberpole.errors import InputError, must
from barberpole.units import NT_PER_UT

FIRST_YEAR, LAST_YEAR = 1900, 2030  # what IGRF-14 covers
HIGHEST_KM = 600.0  # above, the field of currents in space counts


def geomagnetic_field_ut(lat_deg: float, lon_deg: float, height_km: float, day: date) -> np.ndarray:
    """Field (east, north, up) in µT, (3,). Raises InputError for places and dates that the model does not cover."""
    _check(lat_deg, lon_deg, height_km, day)
    moment = datetime(day.year, day.month, day.day)
    components = ppigrf.igrf(lon_deg, lat_deg, height_km, moment)
    return np.array([float(np.squeeze(part)) for part in components]) / NT_PER_UT


def geomagnetic_magnitude_ut(lat_deg: float, lon_deg: float, height_km: float, day: date) -> float:
    """Magnitude of the field in µT."""
    return float(np.linalg.norm(geomagnetic_field_ut(lat_deg, lon_deg, height_km, day)))


def declination_deg(lat_deg: float, lon_deg: float, height_km: float, day: date) -> float:
    """Angle from true to magnetic north, east positive: the delta of eq. 1.1."""
    east, north, _ = geomagnetic_field_ut(lat_deg, lon_deg, height_km, day)
    return float(np.rad2deg(np.arctan2(east, north)))


def inclination_deg(lat_deg: float, lon_deg: float, height_km: float, day: date) -> float:
    """Angle of the field below the horizon."""
    east, north, up = geomagnetic_field_ut(lat_deg, lon_deg, height_km, day)
    return float(np.rad2deg(np.arctan2(-up, np.hypot(east, north))))


def _check(lat_deg: float, lon_deg: float, height_km: float, day: date) -> None:
    if not -90.0 < lat_deg < 90.0:
        raise InputError(must("the latitude", "between -90 and 90 degrees, without the poles", lat_deg))
    if not -180.0 <= lon_deg <= 360.0:
        raise InputError(must("the longitude", "from -180 to 360 degrees", lon_deg))
    if not -10.0 <= height_km <= HIGHEST_KM:
        raise InputError(must("the height", f"from -10 to {HIGHEST_KM:g} km", height_km))
    if not FIRST_YEAR <= day.year < LAST_YEAR:
        raise InputError(must("the date", f"from {FIRST_YEAR} to before {LAST_YEAR}", day))
