"""K of the scalar calibration: from the geomagnetic model at a place and date, by hand, from the log, or not at all."""

import json
from datetime import date
from pathlib import Path

import numpy as np
import pytest
from barberpole.challenge.motion import directions
from barberpole.cli import run as command
from barberpole.log import Log, write_log
from barberpole.navigation.geomagnetic import geomagnetic_magnitude_ut

PLACE, DAY = "48.7215,2.2092,160", "2012-06-01"  # thesis 6.1.3.2; Plateau de Saclay lies 160 m high
SITE_UT = geomagnetic_magnitude_ut(48.7215, 2.2092, 0.16, date(2012, 6, 1))


@pytest.fixture
def turned(tmp_path):
    """A log of the sensor turned at that place: 20 LSB/µT on all axes."""
    rng = np.random.default_rng(1)
    y = 20.0 * SITE_UT * directions(3000, rng) + rng.normal(size=(3, 3000)) + np.array([[100.0], [-50.0], [20.0]])

    def write(**columns):
        names = dict(zip(("x_lsb", "y_lsb", "z_lsb"), y, strict=True))
        path = tmp_path / "turned.csv"
        write_log(Log({**names, **columns}, Path("made.csv"), "0" * 64), path)
        return str(path)

    return write


def fit(capsys, *arguments):
    assert command(["fit", *arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("name", ["ellipsoid", "ellipsoid_algebraic", "iterative"])
def test_gains_are_those_of_the_place(turned, capsys, name):
    found = fit(capsys, turned(), "--method", name, "--place", PLACE, "--date", DAY)
    assert found["values"]["K"]["value"] == pytest.approx(SITE_UT)
    assert found["values"]["L.11"]["value"] == pytest.approx(1.0 / 20.0, rel=1e-4)
    assert found["parameters"]["scale.z"]["value"] == pytest.approx(20.0, rel=1e-4)
    assert not any("not known" in note for note in found["notes"])


def test_without_a_place_it_says_what_is_not_known(turned, capsys):
    found = fit(capsys, turned(), "--method", "ellipsoid")
    assert any("K is not known" in note for note in found["notes"])
    assert found["values"]["K"]["stderr"] is None
    assert found["parameters"]["scale.x"]["value"] == pytest.approx(20.0 * SITE_UT / 50.0, rel=1e-4)


def test_the_general_fit_takes_it_too_and_the_calibration_keeps_it(turned, capsys, tmp_path):
    kept = tmp_path / "calibration.toml"
    model = ("--model", "bias,scale,misalignment", "--magnitude", f"{SITE_UT}", "-o", str(kept))
    assert fit(capsys, turned(), *model)["parameters"]["scale.y"]["value"] == pytest.approx(20.0, rel=1e-4)
    assert f"magnitude_ut = {SITE_UT}" in kept.read_text()


def test_the_thesis_site():
    assert 47.5 < SITE_UT < 48.5  # the 1.28 µT of fig. 5.15 are B²/(2 H_k) of 48.0 µT


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("--place", "48.7"), "LAT,LON"),
        (("--place", "48.7,2.2"), "--date"),
        (("--place", "95,2", "--date", DAY), "between -90 and 90"),
        (("--place", PLACE, "--date", "June"), "YYYY-MM-DD"),
        (("--place", PLACE, "--date", "1850-01-01"), "from 1900"),
        (("--place", PLACE, "--date", DAY, "--magnitude", "48"), "both"),
        (("--magnitude", "-1"), "above 0"),
        (("--date", DAY), "alone"),
    ],
)
def test_refusals(turned, capsys, arguments, reason):
    assert command(["fit", turned(), "--method", "ellipsoid", *arguments]) == 2
    assert reason in capsys.readouterr().err


def test_a_log_that_says_its_field_is_believed(turned, capsys):
    path = turned(b_ut=np.full(3000, 48.0))
    assert command(["fit", path, "--method", "ellipsoid", "--magnitude", "50"]) == 2
    assert "b_ut" in capsys.readouterr().err
    assert fit(capsys, path, "--method", "ellipsoid")["values"]["K"]["value"] == 48.0
