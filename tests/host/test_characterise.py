"""Characterisation on simulated truth: what was put in comes out, within its own error bars."""

import json
from pathlib import Path

import numpy as np
import pytest
from barberpole.challenge import noise
from barberpole.characterise.angles import alignment_error_deg, heading_deg, heading_error_deg, noise_angle_deg
from barberpole.characterise.kinds import kind
from barberpole.characterise.noise import noise_figures, outliers
from barberpole.characterise.response import bandwidth_hz, first_order, response
from barberpole.characterise.sheet import make_sheet
from barberpole.characterise.sine import bin_probability, fit_histogram, fit_sine
from barberpole.characterise.temperature import course, thermometer
from barberpole.cli import run as command
from barberpole.errors import InputError
from barberpole.log import Log, read_log, write_log
from barberpole.trajectory.programs import FREQUENCIES_HZ, frequency_program, lin_60000, turn_over_program

DATA = Path(__file__).parents[3] / "shared" / "data"
GAIN_NT = np.array([65.7, 65.7, 73.0])  # nT/LSB of an HMC5983, article table 1
SIGMA_NT = np.array([54.3, 54.3, 59.5])
OFFSET_LSB = np.array([120.0, -80.0, 40.0])
RATE_HZ = 75.0


def make_log(y, name="made.csv", **columns):
    names = dict(zip(("x_lsb", "y_lsb", "z_lsb"), y, strict=True))
    return Log({**names, **{k: np.asarray(v, float) for k, v in columns.items()}}, Path(name), "0" * 64)


def counts(field_nt, rng):
    """Whole counts of an HMC5983 in a field (3, n) in nT."""
    noisy = field_nt + SIGMA_NT[:, None] * rng.normal(size=field_nt.shape)
    return np.round(noisy / GAIN_NT[:, None] + OFFSET_LSB[:, None])


def times(n):
    return np.arange(n) / RATE_HZ


def linearity_log(rng, temp_c=25.0, drift=0.0, name="lin.csv"):
    field = np.repeat(lin_60000().field_ut, 25, axis=0).T
    y = counts(1000.0 * field * (1.0 + drift), rng)
    applied = dict(zip(("bx_ut", "by_ut", "bz_ut"), field, strict=True))
    return make_log(y, name, t_s=times(y.shape[1]), temp_c=np.full(y.shape[1], temp_c), **applied)


def rest_log(rng, n=22500):
    return make_log(counts(np.zeros((3, n)), rng), "rest.csv", t_s=times(n))


def sine_log(rng, bandwidth=126.0, seconds=60):
    """The frequency program on a slanted sensor: 4000 nT peak to peak along (1, 1, 1)."""
    n = int(seconds * RATE_HZ)
    parts = []
    for f in FREQUENCIES_HZ:
        wave = 2000.0 * float(first_order(f, bandwidth)) * np.sin(2 * np.pi * 1.0003 * f * times(n) + 0.4)
        parts.append(counts(np.ones((3, 1)) / np.sqrt(3) * wave, rng))
    y = np.hstack(parts)
    return make_log(y, "sine.csv", t_s=times(y.shape[1]), f_hz=np.repeat(FREQUENCIES_HZ, n))


def test_sine_fit_finds_the_frequency():
    rng, t = np.random.default_rng(1), times(4500)
    found = fit_sine(t, 3.0 + 2.0 * np.cos(2 * np.pi * 1.013 * t + 0.7) + 0.5 * rng.normal(size=t.size), 1.0)
    assert found.frequency_hz == pytest.approx(1.013, abs=1e-4)
    assert abs(found.amplitude - 2.0) < 4 * found.stderr
    assert found.phase_rad % (2 * np.pi) == pytest.approx(0.7, abs=0.05)
    assert found.rms == pytest.approx(0.5, rel=0.05)
    with pytest.raises(InputError, match="one period"):
        fit_sine(t, np.zeros_like(t), 0.001)


@pytest.mark.parametrize("frequency_hz", FREQUENCIES_HZ)
def test_histogram_finds_the_amplitude_at_every_frequency_of_the_article(frequency_hz):
    """Fig. 3: 2000 nT under 134 nT of noise in counts of 79 nT, above half the sampling rate too."""
    rng, t = np.random.default_rng(2), times(4500)
    y = np.round((2000.0 * np.sin(2 * np.pi * 1.0003 * frequency_hz * t) + 133.7 * rng.normal(size=t.size)) / 78.6)
    found = fit_histogram(y, 133.7 / 78.6)
    assert abs(found.amplitude * 78.6 - 2000.0) < max(4 * found.stderr * 78.6, 20.0)


def test_density_in_its_limits():
    edges = np.linspace(-3, 3, 601)
    middle = 0.5 * (edges[1:] + edges[:-1])
    gauss = np.exp(-(middle**2) / 2) / np.sqrt(2 * np.pi) * 0.01
    assert np.allclose(bin_probability(edges, 0.0, 0.0, 1.0), gauss, atol=1e-6)  # (9) alone
    inside = np.abs(middle) < 0.9
    arcsine = 0.01 / (np.pi * np.sqrt(np.where(inside, 1 - middle**2, 1.0)))
    assert np.allclose(bin_probability(edges, 1.0, 0.0, 0.02)[inside], arcsine[inside], rtol=0.02)  # (8) alone
    assert bin_probability(edges, 1.0, 0.0, 0.1).sum() == pytest.approx(1.0)


def test_white_noise_is_told_from_flicker():
    rng = np.random.default_rng(3)
    white = noise_figures(2.0 * rng.normal(size=(3, 20000)), RATE_HZ)
    assert white.corner_hz == 0.0
    assert np.allclose(white.std, 2.0, atol=4 * white.std_stderr.max())
    assert np.allclose(white.white, 2.0 / np.sqrt(RATE_HZ / 2), rtol=0.03)
    assert np.all(np.abs(white.at_1_hz - white.white) < 4 * white.at_1_hz_stderr)
    flicker = noise_figures(noise.draw(20000, 2.0, 0.1, rng), RATE_HZ)
    assert flicker.corner_hz == pytest.approx(7.5, rel=0.4)  # 0.1 of the rate
    assert flicker.density[0, 1] > 3 * flicker.density[0, -2]
    with pytest.raises(InputError, match="256 rows"):
        noise_figures(np.zeros((3, 100)), RATE_HZ)


def test_outlier_rate():
    rng = np.random.default_rng(4)
    y = np.round(1.7 * rng.normal(size=(3, 20000)))
    assert outliers(y).mean() < 1e-4
    hit = rng.choice(20000, 40, replace=False)
    y[1, hit] += 200.0
    assert outliers(y)[1].sum() == pytest.approx(40, abs=2)


def test_noise_induced_angles_of_the_article():
    table = {(133.7, 147.1): (0.38, 0.72), (54.3, 59.5): (0.15, 0.29), (331.3, 706.3): (1.51, 2.85)}
    for (xy, z), printed in table.items():
        ours = [noise_angle_deg(xy, z, field) for field in (30_000.0, 16_000.0)]
        assert ours == pytest.approx(printed, abs=0.006)


def test_headings():
    field = np.array([[20.0, 0.0, -20.0], [0.0, -20.0, 0.0], [40.0, 40.0, 40.0]])
    assert np.allclose(heading_deg(field), [0.0, 90.0, 180.0])
    assert np.allclose(heading_error_deg(field, np.roll(field, 1, axis=1)), [-180, 90, 90])
    tilted = np.array([[20.0], [0.0], [40.0]]) + np.array([[0.0], [1e-9], [0.0]])
    assert alignment_error_deg(tilted, field[:, :1])[0] == pytest.approx(np.degrees(1e-9 / np.sqrt(2000)), rel=1e-4)


def test_response_is_relative_to_the_slowest():
    f = np.array(FREQUENCIES_HZ)
    got = response(f[::-1], np.outer([1.0, 2.0, 3.0], first_order(f, 60.0))[:, ::-1])
    assert np.allclose(got.relative, first_order(f, 60.0) / first_order(1.0, 60.0))
    assert np.all(got.stderr < 1e-12)
    assert bandwidth_hz(60.0, float(first_order(60.0, 60.0))) == pytest.approx(60.0)
    assert first_order(60.0, 60.0) == pytest.approx(0.70, abs=0.01)  # article 3.1: 70 % at 60 Hz is 60 Hz of bandwidth


def test_courses_and_their_drift():
    rng, t = np.random.default_rng(5), np.linspace(25, 70, 20)
    drift_nt = 1e-3 * (1.0 * t - 30.0)  # article table 1, HMC5983: 1.0 T - 30 pT/LSB/K
    values = 65.7 + 1e-3 * (0.5 * t**2 - 30.0 * t) + 1e-3 * rng.normal(size=20)
    found = course(t, values, 2)
    drift, error = found.drift(25.0)
    assert abs(drift - drift_nt[0]) < 4 * error
    assert found.r_squared > 0.94  # what the article calls a good calibration
    with pytest.raises(InputError, match="4 different temperatures"):
        course(np.array([20.0, 30.0, 40.0]), np.zeros(3), 2)


def test_internal_thermometer():
    rng, t = np.random.default_rng(6), np.linspace(70, 25, 400)
    raw = np.round((t - 25.0) * 8.0 + rng.normal(size=400))
    found = thermometer(raw, t)
    assert found.c_per_lsb == pytest.approx(1 / 8, rel=0.01)
    assert found.rms_c < 0.2
    with pytest.raises(InputError, match="three or more levels"):
        thermometer(np.zeros(10), t[:10])


def test_kinds_are_told_from_the_data():
    rng = np.random.default_rng(7)
    assert kind(linearity_log(rng)) == "linearity"
    assert kind(rest_log(rng, 2000)) == "at rest"
    assert kind(sine_log(rng, seconds=4)) == "sine"
    field = rng.normal(size=(3, 2000))
    assert kind(make_log(counts(45e3 * field / np.linalg.norm(field, axis=0), rng))) == "turned"
    slow = np.sin(np.arange(2000) / 300.0) * np.array([[20e3], [5e3], [0.0]])
    with pytest.raises(InputError, match="moves a little"):
        kind(make_log(counts(slow, rng)))


def figures(sheet):
    return {(f.quantity, f.case): f for f in sheet.figures}


def test_the_sheet_of_a_sensor_like_table_1():
    rng = np.random.default_rng(8)
    _, turn = turn_over_program(200)
    turned = make_log(counts(np.zeros((3, 800)), rng), "turn.csv", turn=turn)
    warm = [linearity_log(rng, t, 4e-4 * (t - 25.0), f"lin{t:.0f}.csv") for t in (0.0, 15.0, 25.0, 40.0, 55.0, 70.0)]
    sheet = make_sheet([*warm, rest_log(rng), sine_log(rng), turned])
    got = figures(sheet)
    for i, axis in enumerate("xyz"):
        one = got["linear sensitivity", axis]
        assert abs(one.value - GAIN_NT[i]) < 5 * one.stderr + 1e-5 * GAIN_NT[i]
        step = GAIN_NT[i] / np.sqrt(12.0)  # the converter's own noise adds
        assert got["noise standard deviation", axis].value == pytest.approx(np.hypot(SIGMA_NT[i], step), rel=0.03)
        turn_offset = got["offset by turn-over", axis]
        assert abs(turn_offset.value - OFFSET_LSB[i] * GAIN_NT[i]) < 5 * turn_offset.stderr
        drift = got["sensitivity drift at 25 °C", axis]
        assert drift.value == pytest.approx(-4e-4 * GAIN_NT[i] * 1000, rel=0.05)
    assert got["misalignment angle", "maximum"].value < 0.1
    assert got["alignment uncertainty by noise", "B = 30000 nT"].value == pytest.approx(0.16, abs=0.02)
    assert got["relative amplitude", "61 Hz"].value == pytest.approx(float(first_order(61.0, 126.0)), abs=0.03)
    assert sheet.noise_unit == "nT"


def test_characterise_command(tmp_path, capsys):
    rng = np.random.default_rng(9)
    paths = [tmp_path / "lin.csv", tmp_path / "rest.csv"]
    for path, log in zip(paths, (linearity_log(rng), rest_log(rng, 4000)), strict=True):
        write_log(log, path)
    page = tmp_path / "sheet.html"
    assert command(["characterise", *map(str, paths), "-o", str(page), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert any(f["quantity"] == "linear sensitivity" and f["stderr"] > 0 for f in said["figures"])
    text = page.read_text()
    assert "noise density at 1 Hz" in text
    assert "http" not in text.split("<body>")[1].split("<footer>")[0]
    assert command(["characterise", *map(str, paths)]) == 0
    assert "±" in capsys.readouterr().out


def test_recorded_logs():
    path = DATA / "hmc5883l_full_sphere.csv"
    if not path.exists():
        pytest.skip(f"{path} is not here: the recorded logs are not part of the project")
    got = figures(make_sheet([read_log(path)]))
    # 1090 LSB/G is 92 nT/LSB; the field's magnitude is not in the log, so the three are relative
    assert got["linear sensitivity", "x"].value / got["linear sensitivity", "z"].value == pytest.approx(0.89, abs=0.05)
    assert got["offset", "y"].stderr > 0


def test_programs():
    lin = lin_60000()
    assert np.abs(lin.field_ut).max() == 60.0
    assert np.allclose(lin.field_ut.sum(axis=0), 0.0)
    assert np.all(np.count_nonzero(lin.field_ut, axis=1) <= 1)
    assert [tone.frequency_hz for tone in frequency_program("y")] == list(FREQUENCIES_HZ)
    assert np.ptp(frequency_program("y")[0].trajectory.field_ut[:, 1]) == pytest.approx(4.0)
    with pytest.raises(InputError, match="a part of 60"):
        lin_60000(7.0)
    with pytest.raises(InputError, match="at least 2"):
        turn_over_program(1)
