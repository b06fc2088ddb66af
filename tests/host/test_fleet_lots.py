"""What many boards tell together: what they share, who stands out, what a lot lends to a new board."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from barberpole import cli
from barberpole.calibrating import calibration_of
from barberpole.calibration import read_calibration
from barberpole.challenge import noise
from barberpole.challenge.record import Recipe, scene_of
from barberpole.challenge.world import reading, strength_for
from barberpole.effects import Conditions
from barberpole.errors import InputError
from barberpole.fit.fit import fit_log
from barberpole.fit.prior import Prior, fit_with_prior
from barberpole.fleet.lots import lot_effects
from barberpole.fleet.prior import prior_of
from barberpole.fleet.scores import scores
from barberpole.fleet.settings import settings_of
from barberpole.fleet.spread import spreads
from barberpole.fleet.summary import summarise
from barberpole.fleet.table import read_fleet, write_fleet
from barberpole.fleet.work import fitted_row
from barberpole.log import Log
from barberpole.modelfile import ModelFile
from barberpole.observations import observations

MODEL = ModelFile(("bias", "scale", "misalignment"))
NOISE_UT = 0.2
TRUE_MEAN = np.array([0.01, -0.02, 0.005, 0.0, 0.01, 0.02, 10.0, 9.0, 11.0, 20.0, -30.0, 5.0])
TRUE_WIDTH = np.array([0.005] * 6 + [0.1] * 3 + [8.0] * 3)
NAMES = [f"misalignment.{ij}" for ij in ("xy", "xz", "yz", "yx", "zx", "zy")]
NAMES += [f"{effect}.{axis}" for effect in ("scale", "bias") for axis in "xyz"]


def lot_log(effect, size, rows, seed, board, own=False, corner=0.0):
    """A log of one board of a lot whose boards share an effect `size` times the noise, or have each its own factors."""
    recipe = Recipe({}, rows=rows, seed=seed + 1000 * (board + 1), corner=corner)
    scene = scene_of(recipe, rows)
    if not own:
        scene = replace(scene, factors=factors_of(seed))
    strength = {effect: strength_of(effect, size, seed)} if effect else {}
    rng = np.random.default_rng(recipe.seed + 10_000_000)
    y = reading(scene, strength) + noise.draw(rows, NOISE_UT, corner, rng)
    y = 10.0 * rng.uniform(0.85, 1.15, (3, 1)) * y + rng.uniform(-150, 150, (3, 1))
    columns = {"t_s": scene.t_s, "state": scene.state, "temp_c": scene.temp_c, "load_a": scene.load_a}
    for i, axis in enumerate("xyz"):
        columns |= {f"{axis}_lsb": y[i], f"b{axis}_ut": scene.field_ut[i], f"i{axis}_ma": scene.i_ma[i]}
    return Log(columns, Path(f"board{board:03}.parquet"), "")


@cache
def factors_of(seed):
    return scene_of(Recipe({}, rows=300, seed=seed), 300).factors


@cache
def strength_of(effect, size, seed):
    scene = replace(scene_of(Recipe({}, rows=3000, seed=seed), 3000), factors=factors_of(seed))
    return strength_for(effect, size * NOISE_UT, scene)


def lot(effect, size, boards, rows, seed, **how):
    """The column `scores` of a lot's diagnosis."""
    found = []
    for board in range(boards):
        log = lot_log(effect, size, rows, seed, board, **how)
        found.append(json.dumps(scores(fit_log(log, MODEL), MODEL, True)))
    return found


def named(found):
    return [(one.effect, *one.rivals) for one in found]


def test_an_effect_too_small_for_one_board_is_named_from_the_lot():
    """A tenth of the noise on each; the mean over the boards is what was put in."""
    told = lot("cross_field", 0.1, 24, 250, seed=1)
    (found,) = lot_effects(told)
    assert (found.effect, found.rivals) == ("cross_field", ())
    assert found.common > 50 > 10 > found.individual
    assert found.kind == "the same on all boards"
    assert found.size == pytest.approx(0.1, abs=0.03)
    strength = strength_of("cross_field", 0.1, 1) * factors_of(1)[0]
    for name, truth in zip("xyz", strength, strict=True):
        value, error = found.parameters[name]
        assert abs(value - truth) < 4 * error
    assert max(gain_on_one(text, "cross_field") for text in told) < 10.0


def gain_on_one(text, effect):
    """What one board alone would give for the effect: the fall of the information criterion."""
    board = json.loads(text)
    best = 0.0
    for form in board["forms"]:
        if form["effect"] == effect:
            u, m = np.array(form["u"]), np.array(form["m"]).reshape(len(form["u"]), -1)
            best = max(best, u @ np.linalg.pinv(m, hermitian=True) @ u - form["rank"] * np.log(board["count"]))
    return best


def test_a_lot_without_an_effect_names_none():
    assert lot_effects(lot(None, 0.0, 16, 250, seed=2)) == []


def test_one_bad_board_makes_no_lot_effect():
    told = lot(None, 0.0, 14, 250, seed=3)
    told[5] = lot("quadratic", 30.0, 1, 250, seed=4)[0]
    assert lot_effects(told) == []


@pytest.mark.bench
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("effect", "own"), [("cross_field", False), ("quadratic", False), ("lag", False), ("bias_temperature", True)]
)
def test_two_hundred_boards_name_a_tenth_of_the_noise(effect, own, seed):
    found = lot_effects(lot(effect, 0.1, 200, 300, 100 + seed, own=own))
    print(
        f"\n{effect:<20} seed {seed}  {[(n, round(one.gain)) for n, one in zip(named(found), found, strict=True)]}",
        end="",
    )
    assert effect in named(found)[0]


@pytest.mark.bench
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("corner", [0.0, 0.1, 1 / 3])
def test_two_hundred_boards_without_an_effect_name_none(corner, seed):
    assert lot_effects(lot(None, 0.0, 200, 300, 200 + seed, corner=corner)) == []


def rows_matrix(angles):
    out = np.eye(3)
    places = ((0, 1), (0, 2), (1, 2), (1, 0), (2, 0), (2, 1))
    for (i, j), value in zip(places, angles, strict=True):
        out[i, j] = value
    return out / np.linalg.norm(out, axis=1)[:, None]


def board_log(seed, rows=200, arc_deg=None, common_scale=False):
    """A log of a board drawn from TRUE_MEAN, TRUE_WIDTH: turned all round, or about one axis by `arc_deg` only."""
    rng = np.random.default_rng(seed)
    p = rng.normal(TRUE_MEAN, TRUE_WIDTH)
    if common_scale:
        p[6:9] = TRUE_MEAN[6:9]
    field = rng.normal(size=(3, rows))
    if arc_deg:
        a = np.radians(arc_deg) * np.linspace(0, 1, rows) + rng.uniform(0, 2 * np.pi)
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        field = turn @ np.stack([0.5 * np.cos(a), -0.5 * np.sin(a), np.full(rows, np.sqrt(0.75))])
    field *= 50.0 / np.linalg.norm(field, axis=0)
    y = p[6:9, None] * (rows_matrix(p[:6]) @ field) + p[9:, None] + 2.0 * rng.normal(size=(3, rows))
    columns = {f"{axis}_lsb": y[i] for i, axis in enumerate("xyz")}
    columns |= {f"b{axis}_ut": field[i] for i, axis in enumerate("xyz")}
    return Log(columns, Path(f"lot1/board{seed:03}.parquet"), f"{seed:064}"), p


@pytest.fixture(scope="module")
def factory(tmp_path_factory):
    """A fleet of sixty boards; board000 once more a year later, board007 with a bias far out."""
    path = tmp_path_factory.mktemp("fleet") / "fleet.parquet"
    rows = []
    for seed in range(60):
        log, _ = board_log(seed, common_scale=True)
        if seed == 7:
            log = replace(log, columns=log.columns | {"x_lsb": log["x_lsb"] + 90.0})
        rows.append(row(log))
    again, _ = board_log(0, common_scale=True)
    again = replace(again, columns=again.columns | {"z_lsb": again["z_lsb"] + 5.0}, sha256="f" * 64)
    rows.append(row(again) | {"log": "lot1/board000_2027-05-01.parquet"})
    bad = {"log": "lot1/board999.parquet", "log_sha256": None, "told": {}, "status": "failed", "reason": "no log"}
    write_fleet([*rows, bad], settings_of("fit", MODEL), path)
    return path


def row(log):
    fit = fit_log(log, MODEL)
    head = {"log": str(log.path), "log_sha256": log.sha256, "told": {}, "status": "ok", "reason": None, "n": log.n}
    return head | fitted_row(fit, calibration_of(fit, log, MODEL))


def test_what_a_model_of_sensor_shares_and_what_is_individual(factory):
    found = {one.name: one for one in spreads(read_fleet(factory).latest())}
    assert {name: found[name].kind for name in ("scale.x", "scale.y", "scale.z")} == dict.fromkeys(
        ("scale.x", "scale.y", "scale.z"), "common"
    )
    assert {found[f"bias.{axis}"].kind for axis in "xyz"} == {"individual"}
    for name, mean, width in zip(NAMES, TRUE_MEAN, TRUE_WIDTH, strict=True):
        one = found[name]
        assert abs(one.mean - mean) < 4 * one.mean_stderr
        if not name.startswith("scale"):
            assert one.interval[0] * 0.8 < width < one.interval[1] * 1.25
    angle = found["misalignment.xy"]
    # of 50 µT turned all round, a third of the square lies along each axis
    assert angle.error_lsb == pytest.approx(angle.tau * 10.0 * 50.0 / np.sqrt(3) / np.sqrt(3), rel=0.1)


def test_a_short_rotation_with_the_lot_is_a_calibration(factory):
    """The prior beats both the lot's mean and the log alone, and its intervals hold the truth."""
    prior = prior_of(read_fleet(factory), MODEL)
    errors, z = [], []
    for seed in range(100, 124):
        log, truth = board_log(seed, rows=60, arc_deg=60.0, common_scale=True)
        with_it, without = fit_with_prior(observations(log), MODEL, prior), fit_log(log, MODEL)
        mean = np.array([prior.values[name][0] for name in with_it.model.names])
        errors.append([error_ut(with_it.model, p, truth) for p in (with_it.p, mean, without.p)])
        z.append((with_it.p - truth) / with_it.stderr)
        assert with_it.converged
    beside, mean, alone = np.median(errors, axis=0)
    assert beside < 0.7 * mean
    assert beside < 0.3 * alone
    assert 0.9 < np.mean(np.abs(z) < 1.96) < 0.99
    assert 0.8 < np.sqrt(np.mean(np.square(z))) < 1.2


def error_ut(model, p, truth):
    """RMS error of the calibrated field over all directions."""
    rng = np.random.default_rng(1)
    field = rng.normal(size=(3, 300))
    field *= 50.0 / np.linalg.norm(field, axis=0)
    return float(
        np.sqrt(
            np.mean(
                np.sum((model.invert(model.predict(field, truth, Conditions()), p, Conditions()) - field) ** 2, axis=0)
            )
        )
    )


def test_a_scalar_short_rotation_too():
    """Where the plain fit refuses. On a cone the derivatives' noise must not pass for knowledge: the intervals hold."""
    rng, z = np.random.default_rng(5), []
    names = [n for n in NAMES if n not in ("misalignment.yx", "misalignment.zx", "misalignment.zy")]
    kept = [NAMES.index(n) for n in names]
    values = {n: (m, w) for n, m, w in zip(names, TRUE_MEAN[kept], TRUE_WIDTH[kept], strict=True)}
    prior = Prior(values, "lot.parquet", "", 100, vector=False)
    for _ in range(25):
        p = rng.normal(TRUE_MEAN, TRUE_WIDTH)
        p[3:6] = 0.0
        a = np.linspace(0, 2 * np.pi, 200)
        field = 50.0 * np.stack([0.5 * np.cos(a), -0.5 * np.sin(a), np.full(200, np.sqrt(0.75))])
        field = np.linalg.qr(rng.normal(size=(3, 3)))[0] @ field
        y = p[6:9, None] * (rows_matrix(p[:6]) @ field) + p[9:, None] + 2.0 * rng.normal(size=(3, 200))
        log = Log({f"{axis}_lsb": y[i] for i, axis in enumerate("xyz")} | {"b_ut": np.full(200, 50.0)}, Path("a"), "")
        fit = fit_with_prior(observations(log), MODEL, prior)
        z.append((fit.p - p[kept]) / fit.stderr)
    assert np.mean(np.abs(z) < 1.96) > 0.88
    assert abs(np.mean(z, axis=0)).max() < 0.7


def test_a_prior_of_no_width_is_the_mean_and_of_any_width_is_no_prior():
    log, _ = board_log(300)
    plain = fit_log(log, MODEL)
    for width, wanted in ((1e-9, TRUE_MEAN), (1e9, plain.p)):
        prior = Prior(dict.fromkeys(NAMES, (0.0, width)), "", "", 9, True)
        prior = replace(prior, values={n: (m, width) for n, m in zip(NAMES, TRUE_MEAN, strict=True)})
        found = fit_with_prior(observations(log), MODEL, prior)
        assert found.p == pytest.approx(wanted, rel=1e-5, abs=1e-5)
    assert found.stderr == pytest.approx(plain.stderr, rel=0.01)
    assert found.heldout_rms_lsb == pytest.approx(plain.heldout_rms_lsb, rel=1e-3)


def test_the_calibration_states_its_prior(factory, tmp_path, capsys):
    log, _ = board_log(200, rows=60, arc_deg=60.0)
    path, output = tmp_path / "short.parquet", tmp_path / "calibration.toml"
    pq.write_table(pa.table(log.columns), path)
    words = ["fit", str(path), "--model", "bias,scale,misalignment", "-o", str(output), "--json"]
    assert cli.run([*words, "--prior", str(factory)]) == 0
    said = json.loads(capsys.readouterr().out)
    prior = read_calibration(output).prior
    assert prior is not None
    assert (prior.boards, prior.sha256) == (60, read_fleet(factory).sha256)
    assert said["prior"]["width"] == prior.width
    assert prior.width["bias.x"] == pytest.approx(8.0, rel=0.3)
    assert cli.run(words) == 0
    assert read_calibration(output).prior is None


def test_a_prior_of_another_kind_is_refused(factory):
    with pytest.raises(InputError, match="a fleet of the model bias, scale; got one of bias, scale, misalignment"):
        prior_of(read_fleet(factory), ModelFile(("bias", "scale")))
    log, _ = board_log(1)
    scalar = observations(replace(log, columns={k: v for k, v in log.columns.items() if k.endswith("lsb")}))
    with pytest.raises(InputError, match="the same reference"):
        fit_with_prior(scalar, MODEL, prior_of(read_fleet(factory), MODEL))


def test_boards_that_stand_out_and_that_have_changed(factory):
    found = summarise(read_fleet(factory))
    assert {(one.board, one.what) for one in found.outliers} == {("board007", "bias.x")}
    assert found.outliers[0].why.startswith("bias.x is ")
    assert {(one.board, one.parameter) for one in found.changes} == {("board000", "bias.z")}
    change = found.changes[0]
    assert change.values[1] - change.values[0] == pytest.approx(5.0, abs=1e-6)
    assert change.dates == (None, "2027-05-01")
    assert [one["log"] for one in found.failed] == ["lot1/board999.parquet"]


def test_the_report_says_and_draws_it(factory, tmp_path, capsys):
    page = tmp_path / "fleet.html"
    assert cli.run(["fleet", "report", str(factory), "-o", str(page), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["logs"], said["boards"], len(said["parameters"])) == (62, 61, 12)
    text = page.read_text()
    assert "Boards that stand out: 1 of 61; changed: 1; logs that could not be used: 1 of 62." in text
    assert cli.run(["fleet", "report", str(factory)]) == 0
    assert "board007: bias.x is" in capsys.readouterr().out


def test_common_and_individual_as_a_command(factory, capsys):
    assert cli.run(["fleet", "common", str(factory), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)["parameters"]
    assert (said["scale.x"]["kind"], said["bias.x"]["kind"]) == ("common", "individual")
    assert cli.run(["fleet", "common", str(factory)]) == 0
    assert "individual" in capsys.readouterr().out
    assert cli.run(["fleet", "common", str(factory), "--lot", "lot9"]) == 2
    assert "--lot must be one of lot1; got 'lot9'" in capsys.readouterr().err


def test_a_board_of_the_fleet_as_a_calibration_file(factory, tmp_path, capsys):
    output = tmp_path / "calibration.toml"
    assert cli.run(["fleet", "extract", str(factory), "board005", "-o", str(output)]) == 0
    log, _ = board_log(5, common_scale=True)
    assert read_calibration(output).hash == calibration_of(fit_log(log, MODEL), log, MODEL).hash
    assert cli.run(["fleet", "extract", str(factory), "nobody", "-o", str(output)]) == 2
    assert "board nobody must be one that was fitted" in capsys.readouterr().err


def test_a_lot_effect_is_in_the_report_of_a_diagnosed_fleet(factory, tmp_path, capsys):
    told = lot("cross_field", 0.2, 14, 250, seed=1)
    rows = [row(board_log(seed)[0]) | {"verdict": "adequate", "scores": text} for seed, text in enumerate(told)]
    path = tmp_path / "diagnosed.parquet"
    write_fleet(rows, settings_of("diagnose", MODEL), path)
    assert cli.run(["fleet", "report", str(path), "--json", "-o", str(tmp_path / "page.html")]) == 0
    (found,) = json.loads(capsys.readouterr().out)["lots"]["lot1"]
    assert found["effect"] == "cross_field"
    assert "lot lot1 shares cross_field" in (tmp_path / "page.html").read_text()
