"""The article's methods, the offset coils and calibrations over temperature, on simulated truth."""

import json
from pathlib import Path

import numpy as np
import pytest
from barberpole.calibrating import calibration_of
from barberpole.challenge.motion import planar
from barberpole.cli import run as command
from barberpole.errors import InputError
from barberpole.fit.fit import fit_log
from barberpole.log import Log, read_log, write_log
from barberpole.methods.answer import Given
from barberpole.methods.linear import decompose, linear_model
from barberpole.methods.offset_coil import Affine, affine_of, transfer, transferred
from barberpole.methods.polynomial import choose, polynomial_model
from barberpole.methods.registry import find_method
from barberpole.modelfile import read_model
from barberpole.trajectory.programs import lin_60000

M = np.array([[0.066, 0.002, -0.001], [0.003, 0.064, 0.009], [-0.002, 0.001, 0.073]])  # µT/LSB, as of an HMC5983
STRAIGHT = np.diag(np.diag(M))  # axes at right angles: with bent ones the cubic shows in the cross-field terms too
OFFSET_LSB = np.array([120.0, -80.0, 40.0])


def make_log(y, **columns):
    names = dict(zip(("x_lsb", "y_lsb", "z_lsb"), y, strict=True))
    return Log({**names, **{k: np.asarray(v, float) for k, v in columns.items()}}, Path("made.csv"), "0" * 64)


def applied(field):
    return dict(zip(("bx_ut", "by_ut", "bz_ut"), field, strict=True))


def run(name, log, **given):
    return find_method(name).run(log, Given(**given))


def program(repeat=20):
    return np.repeat(lin_60000().field_ut, repeat, axis=0).T


def readings(field, rng=None, sigma_lsb=0.0, cubic=0.0, cross=0.0, matrix=M):
    """Counts of a linear sensor whose own axes then bend: y (1 + cubic y²) and a neighbour's square."""
    y = np.linalg.solve(matrix, field)
    y = y + cubic * y**3 + cross * np.roll(y, 1, axis=0) ** 2 + OFFSET_LSB[:, None]
    return y if rng is None else y + sigma_lsb * rng.normal(size=y.shape)


def test_nine_parameters_come_back():
    field = program()
    found = linear_model(readings(field), field)
    assert np.allclose(found.matrix, M, atol=1e-12)
    assert np.allclose(found.offset_lsb, OFFSET_LSB, atol=1e-8)
    parts = decompose(found.matrix)
    assert np.allclose(parts.rotation @ parts.misalignment @ np.diag(parts.sensitivity), M)
    assert np.allclose(parts.rotation @ parts.rotation.T, np.eye(3))
    assert np.allclose(parts.sensitivity, np.linalg.norm(M, axis=0))  # lengths of the base vectors
    columns = M / np.linalg.norm(M, axis=0)
    assert parts.angle_deg[2] == pytest.approx(np.degrees(np.arccos(columns[:, 1] @ columns[:, 2])) - 90.0)


def test_a_rotation_of_the_sensor_is_all_in_r():
    about = np.radians(33.0)
    r = np.array([[np.cos(about), -np.sin(about), 0], [np.sin(about), np.cos(about), 0], [0, 0, 1]])
    plain, turned = decompose(M), decompose(r @ M)
    assert np.allclose(plain.angle_deg, turned.angle_deg)
    assert np.allclose(plain.sensitivity, turned.sensitivity)
    assert turned.euler_deg[0] - plain.euler_deg[0] == pytest.approx(33.0)


def test_linear_errors_are_what_repeating_shows():
    field, rng = program(4), np.random.default_rng(1)
    answers = [run("linear", make_log(readings(field, rng, 1.0), **applied(field))).values for _ in range(60)]
    for name in ("sensitivity.x", "misalignment.yz", "rotation.z", "offset.y"):
        spread = np.std([a[name].value for a in answers], ddof=1)
        assert answers[0][name].stderr == pytest.approx(spread, rel=0.35)  # 60 repeats: 9 % and its tails


def test_linear_is_held_to_the_general_fit():
    field, rng = program(), np.random.default_rng(2)
    log = make_log(readings(field, rng, 1.0), **applied(field))
    answer, fit = run("linear", log), fit_log(log, read_model("bias,scale,misalignment"))
    # the article regresses the field on noisy readings, which shrinks slopes by sigma²/var(y) = 1e-5
    assert np.all(np.abs(answer.fit.p - fit.p) < 0.2 * fit.stderr)
    assert calibration_of(answer.fit, log, answer.file, "linear").method == "linear"


@pytest.mark.parametrize("name", ["linear", "polynomial"])
def test_vector_methods_refuse(name):
    field = program(4)
    with pytest.raises(InputError, match="applied field"):
        run(name, make_log(readings(field)))
    flat = planar(400, np.random.default_rng(3)) * np.array([[50.0], [50.0], [0.0]])
    with pytest.raises(InputError, match="in a plane"):
        run(name, make_log(readings(flat), **applied(flat)))
    few = np.repeat(np.eye(3) * 40.0, 30, axis=1)
    few = np.hstack([few, -few[:, :30]])
    with pytest.raises(InputError, match="different fields"):
        run(name, make_log(readings(few), **applied(few)))
    with pytest.raises(InputError, match=r"follow the applied field"):
        run(name, make_log(readings(field) * np.array([[1.0], [0.0], [1.0]]), **applied(field)))


def test_polynomial_takes_the_cubic_off():
    """Article 3.1: third order on-axis lowers the residual of an LSM303DLHC-like sensor by up to 80 %."""
    field, rng = program(), np.random.default_rng(4)
    y = readings(field, rng, 0.2, cubic=3e-8, matrix=STRAIGHT)
    answer = run("polynomial", make_log(y, **applied(field)))
    assert "m = 5, n = 1" in answer.notes[0]  # the inverse of a cubic has a fifth power, here twice the noise
    assert answer.values["rms.polynomial"].value < 0.2 * answer.values["rms.linear"].value
    assert answer.values["rms.polynomial"].value == pytest.approx(13.6, rel=0.03)  # 0.2 LSB of noise at 64-73 nT/LSB


def test_degrees_by_heldout_error():
    field, rng = program(), np.random.default_rng(5)
    assert choose(readings(field, rng, 1.0), field)[0] == (1, 1)
    assert choose(readings(field, rng, 1.0, cubic=3e-8, cross=2e-5, matrix=STRAIGHT), field)[0] == (3, 2)
    with pytest.raises(InputError, match="from 1 to the on-axis degree"):
        polynomial_model(readings(field), field, (2, 3))


def test_degree_one_is_the_linear_model():
    field = program(2)
    y = readings(field, np.random.default_rng(6), 0.5)
    straight, line = polynomial_model(y, field, (1, 1)), linear_model(y, field)
    # B_off differs: null-field rows here, the constant of the line there
    slope = straight.rotation @ (np.diag(straight.on[0]) + straight.cross[0])
    assert np.allclose(slope, line.matrix, rtol=2e-3, atol=1e-5)


def test_turn_over_parts_sensor_and_coils():
    rng = np.random.default_rng(7)
    turn, residual = np.repeat([0.0, 1.0, 2.0, 3.0], 500), np.array([3.0, -2.0, 1.0])
    sign = np.array([[1, 1, -1, -1], [1, -1, 1, -1], [1, -1, -1, 1]])[:, turn.astype(int)]
    y = OFFSET_LSB[:, None] + residual[:, None] * sign + 0.8 * rng.normal(size=(3, 2000))
    values = run("turn_over", make_log(y, turn=turn)).values
    for i, axis in enumerate("xyz"):
        assert abs(values[f"offset.{axis}"].value - OFFSET_LSB[i]) < 4 * values[f"offset.{axis}"].stderr
        assert abs(values[f"residual_field.{axis}"].value - residual[i]) < 4 * values[f"residual_field.{axis}"].stderr
    with pytest.raises(InputError, match="column turn"):
        run("turn_over", make_log(y))
    with pytest.raises(InputError, match="on x"):
        run("turn_over", make_log(y[:, :1000], turn=turn[:1000]))


def test_offset_coil_transfer_gives_the_classical_calibration_back():
    rng = np.random.default_rng(8)
    coil = Affine(np.eye(3) + 0.01 * rng.normal(size=(3, 3)), rng.normal(size=3))
    classical = Affine(np.triu(np.eye(3) + 0.03 * rng.normal(size=(3, 3))), rng.normal(size=3))
    h = rng.normal(size=(3, 50))
    again = transferred(coil, transfer(coil, classical))
    assert np.allclose(again.field(h), classical.field(h))


def test_offset_coil_on_a_log(tmp_path):
    rng, n = np.random.default_rng(9), 600
    field = rng.uniform(-60, 60, (3, n))
    factory = make_log(readings(field, rng, 0.5), **applied(field))
    classical = fit_log(factory, read_model("bias,scale,misalignment"))
    calibration = calibration_of(classical, factory, read_model("bias,scale,misalignment"))
    assert np.allclose(affine_of(calibration).a, M, rtol=1e-3, atol=1e-5)
    i_ma = rng.uniform(-3, 3, (3, n))
    y = 21.7 * i_ma * np.array([[15.0], [14.0], [13.0]]) + OFFSET_LSB[:, None]
    currents = dict(zip(("ix_ma", "iy_ma", "iz_ma"), i_ma, strict=True))
    values = run("offset_coil", make_log(y, **currents), against=calibration).values
    assert values["A.22"].value == pytest.approx(1.0 / 14.0)
    assert values["Sc_sigma_c.11"].value == pytest.approx(M[0, 0] * 15.0, rel=1e-3)
    with pytest.raises(InputError, match="coil currents"):
        run("offset_coil", make_log(y))
    with pytest.raises(InputError, match="follow the coil currents"):
        run("offset_coil", make_log(readings(field), **currents))
    with pytest.raises(InputError, match="all three coils"):
        run("offset_coil", make_log(y, **(currents | {"iz_ma": np.zeros(n)})))


def heated(temp_c, rng, n=1500):
    """A log at one temperature: gains +0.03 %/K and a bias with a square in it."""
    field = rng.normal(size=(3, n))
    field *= 48.0 / np.linalg.norm(field, axis=0)
    u = temp_c - 25.0
    y = np.linalg.solve(np.triu(M), field) * (1 - 3e-4 * u) + OFFSET_LSB[:, None] * (1 + 1e-3 * u + 2e-5 * u * u)
    return make_log(y + 0.05 * rng.normal(size=(3, n)), temp_c=np.full(n, temp_c), b_ut=np.full(n, 48.0))


def test_calibrations_over_temperature(tmp_path, capsys):
    rng = np.random.default_rng(10)
    paths = [tmp_path / f"{t}.csv" for t in range(-20, 70, 10)]
    for path, t in zip(paths, range(-20, 70, 10), strict=True):
        write_log(heated(float(t), rng), path)
    out = tmp_path / "table.toml"
    assert command(["calibrate-over-temperature", *map(str, paths), "-o", str(out), "--json"]) == 0
    values = json.loads(capsys.readouterr().out)["values"]
    assert values["a_11.1"]["value"] / values["a_11.0"]["value"] == pytest.approx(3e-4, rel=0.03)
    assert abs(values["residual.b_x"]["value"]) < 10.0  # nT: as IMCS in table 6.1, a few nT
    assert abs(values["residual.a_11"]["value"]) < 100.0  # ppm
    assert "a_11" in out.read_text()
    with pytest.raises(InputError, match="different temperatures"):
        run(
            "temperature",
            make_log(read_log(paths[0]).stack(("x_lsb", "y_lsb", "z_lsb")), temp_c=np.r_[:1500] // 750 * 3.0),
        )
    assert command(["calibrate-over-temperature", str(paths[0]), str(paths[1])]) == 2


def test_one_log_through_several_temperatures():
    rng = np.random.default_rng(11)
    parts = [heated(t, rng, 600) for t in np.linspace(0, 70, 8)]
    joined = {k: np.concatenate([p.columns[k] for p in parts]) for k in parts[0].columns}
    values = run("temperature", Log(joined, Path("made.csv"), "0" * 64)).values
    assert values["a_33.1"].value / values["a_33.0"].value == pytest.approx(3e-4, rel=0.1)
    with pytest.raises(InputError, match="range of temperatures"):
        run("temperature", parts[0])
    with pytest.raises(InputError, match="temp_c"):
        run("temperature", make_log(np.zeros((3, 20))))


def test_methods_command_and_a_table_of_its_own(tmp_path, capsys):
    assert command(["methods", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["methods"]
    assert {"ellipsoid", "iterative", "linear", "polynomial", "cross_axis_search"} <= {m["name"] for m in listed}
    field = program(10)
    path, out = tmp_path / "lin.csv", tmp_path / "poly.toml"
    write_log(make_log(readings(field, np.random.default_rng(12), 1.0, cubic=3e-8), **applied(field)), path)
    assert command(["fit", str(path), "--method", "polynomial", "-o", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["values"]["o11_1"]["unit"] == "uT/LSB"
    assert 'method = "polynomial"' in out.read_text()
    assert command(["fit", str(path), "--method", "linear", "-o", str(tmp_path / "cal.toml")]) == 0
    assert "sensitivity.x" in capsys.readouterr().out
