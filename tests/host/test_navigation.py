"""Heading, velocity from the gradient, and the field at a place."""

from datetime import date

import numpy as np
import pytest
from barberpole.errors import InputError
from barberpole.navigation import geomagnetic, heading, velocity
from scipy.spatial.transform import Rotation

FIELD_ENU_UT = np.array([0.4, 20.9, -43.4])
DECLINATION_DEG = float(np.rad2deg(np.arctan2(0.4, 20.9)))
DAY = date(2020, 1, 1)


def body(vector_enu, true_heading_deg, pitch_deg=0.0, roll_deg=0.0):
    """A vector in the axes of a body (x ahead, y left, z up) with this heading, nose up and rolled to the right."""
    east_to_ahead = Rotation.from_euler("z", 90.0 - true_heading_deg, degrees=True)
    turn = (
        east_to_ahead
        * Rotation.from_euler("y", -pitch_deg, degrees=True)
        * Rotation.from_euler("x", roll_deg, degrees=True)
    )
    return turn.inv().apply(vector_enu)


def test_the_four_points_of_the_compass():
    assert heading.heading_deg(1.0, 0.0) == 0.0
    assert heading.heading_deg(0.0, 1.0) == pytest.approx(90.0)
    assert heading.heading_deg(-1.0, 0.0) == pytest.approx(180.0)
    assert heading.heading_deg(0.0, -1.0, 10.0) == pytest.approx(280.0)


@pytest.mark.parametrize("true_deg", [0.0, 33.0, 123.0, 250.0, 359.0])
def test_level_sensor(true_deg):
    x, y, _ = body(FIELD_ENU_UT, true_deg)
    found = heading.heading_deg(x, y, DECLINATION_DEG)
    assert heading.turn_error_deg(found, true_deg) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("true_deg", [0.0, 33.0, 123.0, 250.0])
@pytest.mark.parametrize(("pitch_deg", "roll_deg"), [(0.0, 0.0), (20.0, 0.0), (-35.0, 60.0), (10.0, 170.0)])
def test_tilted_sensor(true_deg, pitch_deg, roll_deg):
    up = 9.81 * body(np.array([0.0, 0.0, 1.0]), true_deg, pitch_deg, roll_deg)
    field = body(FIELD_ENU_UT, true_deg, pitch_deg, roll_deg)
    found = heading.tilted_heading_deg(field, up, DECLINATION_DEG)
    assert heading.turn_error_deg(found, true_deg) == pytest.approx(0.0, abs=1e-9)


def test_tilt_that_is_ignored_is_an_error():
    x, y, _ = body(FIELD_ENU_UT, 90.0, pitch_deg=10.0)
    assert abs(heading.turn_error_deg(heading.heading_deg(x, y, DECLINATION_DEG), 90.0)) > 10.0


def dipole_ut(position_m):
    """Field of a dipole of 100 A m^2 along z, at a position in m."""
    r = np.linalg.norm(position_m)
    moment = np.array([0.0, 0.0, 100.0])
    return 0.1 * (3 * position_m * (moment @ position_m) / r**5 - moment / r**3)


def test_velocity_through_the_field_of_a_dipole():
    """Four sensors 0.1 mm off the centre; what is left is the curvature of the field over that distance."""
    start, speed = np.array([1.0, 0.7, 0.5]), np.array([0.3, -1.2, 0.8])
    offsets = 1e-4 * np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    gradient = velocity.gradient_ut_per_m(np.array([dipole_ut(start + o) for o in offsets]), offsets)
    step_s = 1e-5
    rate = (dipole_ut(start + speed * step_s) - dipole_ut(start - speed * step_s)) / (2 * step_s)
    np.testing.assert_allclose(velocity.velocity_m_per_s(rate, gradient), speed, rtol=1e-3)
    assert np.trace(gradient) == pytest.approx(0.0, abs=1e-3 * np.abs(gradient).max())  # no sources here
    np.testing.assert_allclose(gradient, gradient.T, atol=1e-3 * np.abs(gradient).max())


def test_two_sensors_give_the_speed_along_their_baseline():
    near, far = dipole_ut(np.array([1.0, 0.7, 0.5])), dipole_ut(np.array([1.001, 0.7, 0.5]))
    slope = velocity.along_gradient_ut_per_m(near, far, 1e-3)
    assert velocity.speed_along_m_per_s(1.5 * slope, slope) == pytest.approx(1.5)


def test_sensors_in_a_plane_are_refused():
    with pytest.raises(InputError, match="not in one plane"):
        velocity.gradient_ut_per_m(np.zeros((4, 3)), np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]))


def test_field_at_paris():
    """IGRF-14 at 48.85 N 2.35 E in 2020: about 48.2 µT, 64 degrees down, 1 degree east."""
    place = (48.85, 2.35, 0.1, DAY)
    assert geomagnetic.geomagnetic_magnitude_ut(*place) == pytest.approx(48.2, abs=0.1)
    assert geomagnetic.inclination_deg(*place) == pytest.approx(64.3, abs=0.2)
    assert geomagnetic.declination_deg(*place) == pytest.approx(1.02, abs=0.1)


def test_field_of_the_model_has_no_sources():
    """div B = 0 and curl B = 0 in the air, by differences over 10 km, at a place where east, north, up are x, y, z."""
    step_km = 10.0
    per_degree_km = np.deg2rad(6378.0)
    rows = []
    for axis in range(3):
        shift = np.zeros(3)
        shift[axis] = step_km
        ends = [place_enu_ut(sign * shift, per_degree_km) for sign in (-1, 1)]
        rows.append((ends[1] - ends[0]) / (2 * step_km))
    gradient = np.array(rows).T
    assert np.trace(gradient) == pytest.approx(0.0, abs=0.02 * np.abs(gradient).max())  # the ellipsoid is not a sphere
    np.testing.assert_allclose(gradient, gradient.T, atol=0.02 * np.abs(gradient).max())


def place_enu_ut(shift_km, per_degree_km):
    """Field near 0 N 0 E in the axes of that place, (3,) µT."""
    east_km, north_km, up_km = shift_km
    lat, lon = north_km / per_degree_km, east_km / per_degree_km
    east, north, up = geomagnetic.geomagnetic_field_ut(lat, lon, 10.0 + up_km, DAY)
    turn = Rotation.from_euler("zy", [lon, -lat], degrees=True)  # of up, east, north
    x, y, z = turn.apply([up, east, north])
    return np.array([y, z, x])


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ((91.0, 0.0, 0.0, DAY), "the latitude"),
        ((0.0, 400.0, 0.0, DAY), "the longitude"),
        ((0.0, 0.0, 1e4, DAY), "the height"),
        ((0.0, 0.0, 0.0, date(1850, 1, 1)), "the date must be from 1900"),
    ],
)
def test_places_outside_the_model_are_refused(place, message):
    with pytest.raises(InputError, match=message):
        geomagnetic.geomagnetic_magnitude_ut(*place)
