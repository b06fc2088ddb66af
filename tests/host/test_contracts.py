"""The public contracts as a script from outside meets them, on logs whose physics shares no code with barberpole."""

import json
import subprocess
import sys

import numpy as np
import pytest
import typer
from barberpole.cli import app, run

LINEAR = "bias,scale,misalignment"
FIT = ("rms_lsb", "rms_ut", "rms_norm_percent", "heldout_rms_lsb", "parameters", "converged", "unobservable")
GAIN = np.array([[1050.0, 12.0, -20.0], [16.0, 930.0, 7.0], [-11.0, 19.0, 1000.0]])  # LSB/µT
OFFSET = np.array([3000.0, -5000.0, 2000.0])
NOISE = 20.0


@pytest.fixture
def call(capsys):
    """call(*words): exit code, the objects on stdout, what stderr says. stdout must hold nothing but JSON."""

    def done(*words):
        code = run([str(word) for word in words] + ["--json"])
        said = capsys.readouterr()
        found = [json.loads(line) for line in said.out.splitlines()]
        return code, (found[0] if len(found) == 1 else found), said.err

    return done


def turned(n=1500, seed=0, cubic=0.0, warm=0.0, motion="all"):
    """Columns of a sensor turned in 48 µT: a field (n, 3) that wanders over the sphere, and what the sensor says."""
    rng, t = np.random.default_rng(seed), np.arange(n) * 0.02
    about = 2.0 * np.pi * 0.61 * t, np.arccos(np.cos(2.0 * np.pi * 0.037 * t + 0.4))
    field = 48.0 * np.stack(
        [np.sin(about[1]) * np.cos(about[0]), np.sin(about[1]) * np.sin(about[0]), np.cos(about[1])], 1
    )
    if motion == "still":
        field = np.repeat(field[:1], n, axis=0)
    temp = 25.0 + 10.0 * np.sin(2.0 * np.pi * t / t[-1])
    bent = field + cubic * field**3
    y = (1.0 + warm * (temp - 25.0))[:, None] * bent @ GAIN.T + OFFSET + NOISE * rng.normal(size=(n, 3))
    columns = {"t_s": t} | {f"{a}_lsb": y[:, i] for i, a in enumerate("xyz")}
    return columns | {f"b{a}_ut": field[:, i] for i, a in enumerate("xyz")} | {"temp_c": temp}


def magnitude_of(columns):
    known = {n: v for n, v in columns.items() if n not in ("bx_ut", "by_ut", "bz_ut")}
    return known | {"b_ut": np.linalg.norm([columns[f"b{a}_ut"] for a in "xyz"], axis=0)}


def written(path, columns, above="", mark=","):
    rows = zip(*(np.asarray(v).tolist() for v in columns.values()), strict=True)
    path.write_text(above + mark.join(columns) + "\n" + "".join(mark.join(map(repr, row)) + "\n" for row in rows))
    return path


def coil_run():
    """A sensor in a shield, driven by its own offset coils (21.7 µT/mA)."""
    rng = np.random.default_rng(3)
    current = rng.normal(size=(600, 3))
    current *= (rng.uniform(1.5, 3.5, 600) / np.linalg.norm(current, axis=1))[:, None]
    y = 21.7 * current @ GAIN.T + OFFSET + NOISE * rng.normal(size=(600, 3))
    found = {"t_s": np.arange(600) * 0.02} | {f"{a}_lsb": y[:, i] for i, a in enumerate("xyz")}
    return found | {f"i{a}_ma": current[:, i] for i, a in enumerate("xyz")}


def turned_over():
    turn = np.repeat([0, 1, 2, 3], 60)
    sign = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])[turn]
    y = OFFSET + sign * np.array([300.0, -200.0, 100.0]) + NOISE * np.random.default_rng(4).normal(size=(240, 3))
    return {f"{a}_lsb": y[:, i] for i, a in enumerate("xyz")} | {"turn": turn}


METHODS = {
    "ellipsoid": lambda: magnitude_of(turned()),
    "ellipsoid_algebraic": lambda: magnitude_of(turned()),
    "iterative": lambda: magnitude_of(turned()),
    "cross_axis_search": lambda: magnitude_of(turned(600)),
    "temperature": lambda: turned(4000, warm=-3e-3),
    "offset_coil": coil_run,
    "linear": turned,
    "polynomial": lambda: turned(cubic=-3e-6),
    "turn_over": turned_over,
}


@pytest.mark.parametrize("method", METHODS)
def test_every_method_answers_with_the_keys_of_fit(call, tmp_path, method):
    log = written(tmp_path / "log.csv", METHODS[method]())
    code, found, _ = call("fit", log, "--method", method)
    assert code == 0
    assert set(FIT) <= set(found)
    assert found["converged"] is True
    # what is left is the noise put in: a temperature's pieces see but a part of the directions each
    assert found["rms_lsb"] == pytest.approx(NOISE, rel=0.5 if method == "temperature" else 0.1)
    assert found["rms_lsb"] < 1.02 * found["heldout_rms_lsb"] < (10 if method == "temperature" else 1.2) * NOISE
    if method != "turn_over":  # its log says nothing of the gain
        assert found["rms_ut"] == pytest.approx(found["rms_lsb"] / 993.0, rel=0.1)
    assert {frozenset(v) for v in found["parameters"].values()} == {frozenset({"value", "stderr", "unit"})}
    assert not any(name.startswith(("rms.", "residual.", "peak_to_peak.")) for name in found["parameters"])


def test_heldout_error_of_the_polynomials_tells_a_bend_from_none(call, tmp_path):
    bent = written(tmp_path / "log.csv", turned(cubic=-3e-6))
    linear, polynomial = (call("fit", bent, "--method", m)[1]["heldout_rms_lsb"] for m in ("linear", "polynomial"))
    assert polynomial == pytest.approx(NOISE, rel=0.05)
    assert linear > 2.0 * NOISE


def test_every_command_has_json():
    def leaves(command, path=()):
        if not hasattr(command, "commands"):
            return [(path, [o for p in command.params for o in p.opts])]
        return [leaf for name, one in command.commands.items() for leaf in leaves(one, (*path, name))]

    found = leaves(typer.main.get_command(app))
    assert len(found) > 30
    assert [path for path, options in found if "--json" not in options] == []


def test_the_twin_says_its_port_as_json():
    words = [sys.executable, "-m", "barberpole", "twin", "pybv11", "--json"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as board:
        said = json.loads(board.stdout.readline())
        board.terminate()
    assert said["port"].startswith("/dev/")
    assert said["board"] == "pybv11"


@pytest.mark.parametrize("unit", [0.01, 1000.0])
@pytest.mark.parametrize("known", ["vector", "magnitude"])
def test_a_wrong_unit_is_bad_input_to_fit_and_diagnose_alike(call, tmp_path, known, unit):
    good = turned() if known == "vector" else magnitude_of(turned())
    log = written(tmp_path / "log.csv", {n: v * unit if n.endswith("_ut") else v for n, v in good.items()})
    fitted, judged = (call(command, log, "--model", LINEAR) for command in ("fit", "diagnose"))
    assert fitted[0] == judged[0] == 2
    assert fitted[2] == judged[2]
    assert "in µT" in judged[2]
    right = written(tmp_path / "good.csv", good)
    code, (first, second), _ = call("diagnose", log, right, "--model", LINEAR)
    assert (code, list(first), second["verdict"]) == (2, ["log", "error"], "adequate")
    assert call("fit", right, "--model", LINEAR, "-o", tmp_path / "cal.toml")[0] == 0
    code, _, said = call("verify", log, "--calibration", tmp_path / "cal.toml")  # no board that has changed
    assert (code, said) == (2, judged[2])


def test_a_column_that_the_model_needs_is_asked_for_by_fit_and_diagnose_alike(call, tmp_path):
    log = written(tmp_path / "log.csv", {n: v for n, v in turned().items() if n != "temp_c"})
    for command in ("fit", "diagnose"):
        code, _, said = call(command, log, "--model", f"{LINEAR},bias_temperature")
        assert code == 2
        assert "temp_c" in said


def test_no_motion_is_refused_by_fit_and_inconclusive_to_diagnose(call, tmp_path):
    log = written(tmp_path / "log.csv", turned(motion="still"))
    code, _, said = call("fit", log, "--model", LINEAR)
    assert code == 2
    assert "turn the sensor through all directions" in said
    code, found, _ = call("diagnose", log, "--model", LINEAR)
    assert (code, found["verdict"]) == (0, "inconclusive")
    assert "turn the sensor through all directions" in found["next_experiment"]


@pytest.mark.parametrize("rows", [6, 20])
@pytest.mark.parametrize("known", ["vector", "magnitude"])
def test_few_rows_are_said_to_be_few(call, tmp_path, known, rows):
    every = {n: v[:: 1500 // rows][:rows] for n, v in turned().items()}
    log = written(tmp_path / "log.csv", every if known == "vector" else magnitude_of(every))
    code, found, said = call("fit", log, "--model", LINEAR)
    if code == 0:  # answered, with errors that are honest, and a sentence
        assert "record at least" in found["notes"][0]
        assert found["notes"][0] in said
    else:
        assert "at least 12 samples" in said
    code, found, _ = call("diagnose", log, "--model", LINEAR)
    assert (code, found["verdict"], found["suspects"]) == (0, "inconclusive", [])
    assert "at least" in found["next_experiment"]


def test_what_a_log_does_not_determine_is_said_in_a_sentence(call, tmp_path):
    log = written(tmp_path / "log.csv", turned() | {"temp_c": np.full(1500, 25.0)})
    code, found, said = call("fit", log, "--model", f"{LINEAR},bias_temperature")
    assert code == 0
    assert set(found["unobservable"]) == {f"bias_temperature.{a}_1" for a in "xyz"}
    assert "does not determine bias_temperature.x_1" in found["notes"][0]
    assert found["notes"][0] in said


@pytest.mark.parametrize(
    "above", ["# by hand\n", "# by hand\n# 12 May\n", "\ufeff# by hand\n", "# by hand, at noon, 24 degC, north\n"]
)
def test_remarks_above_the_names_are_passed_over(call, tmp_path, above):
    plain, remarked = written(tmp_path / "a.csv", turned()), written(tmp_path / "b.csv", turned(), above)
    assert call("fit", remarked, "--model", LINEAR)[1] == call("fit", plain, "--model", LINEAR)[1]


def test_names_in_the_last_remark_are_names(call, tmp_path):
    log = written(tmp_path / "log.csv", turned(), "# by hand\n# ")
    assert call("fit", log, "--model", LINEAR)[1]["n"] == 1500


@pytest.mark.parametrize(
    ("said", "percent", "axes"),
    [
        ("", False, 6),
        ('reference = "vector"', False, 6),
        ('reference = "scalar"', True, 3),
        ('reference = {kind = "magnitude"}', True, 3),
        ("reference = {kind = 'constant', magnitude_ut = 48.0}", True, 3),
    ],
)
def test_the_model_file_says_how_much_of_the_field_is_used(call, tmp_path, said, percent, axes):
    log, model = written(tmp_path / "log.csv", turned()), tmp_path / "model.toml"
    model.write_text(f'effects = ["bias", "scale", "misalignment"]\n{said}\n')
    code, found, _ = call("fit", log, "--model", model, "-o", tmp_path / "cal.toml")
    assert code == 0
    assert (found["rms_norm_percent"] is not None) == percent
    assert sum(name.startswith("misalignment") for name in found["parameters"]) == axes  # no rotation in magnitudes
    assert found["rms_lsb"] == pytest.approx(NOISE, rel=0.05)
    code, checked, _ = call("verify", log, "--calibration", tmp_path / "cal.toml")
    assert (code, checked["pass"], checked["checks"]) == (0, True, ["norm" if percent else "residual"])


@pytest.mark.parametrize("said", ['reference = "vector"', 'reference = "scalar"'])
def test_a_reference_that_the_log_lacks_is_asked_for(call, tmp_path, said):
    held = {n: v for n, v in turned().items() if not n.endswith("_ut")}
    log, model = written(tmp_path / "log.csv", held), tmp_path / "model.toml"
    model.write_text(f'effects = ["bias", "scale", "misalignment"]\n{said}\n')
    code, _, text = call("fit", log, "--model", model)
    assert code == 2
    assert ("bx_ut" if "vector" in said else "b_ut") in text


@pytest.mark.parametrize(
    ("effect", "setting"), [("bias_temperature", "ordr = 2"), ("quadratic", "order = 2"), ("lag", "tau_s = 1.0")]
)
def test_a_setting_that_an_effect_does_not_have_is_refused(call, tmp_path, effect, setting):
    log, model = written(tmp_path / "log.csv", turned()), tmp_path / "model.toml"
    model.write_text(f'effects = ["bias", "scale", "misalignment", "{effect}"]\n[{effect}]\n{setting}\n')
    for command in ("fit", "diagnose"):
        code, _, said = call(command, log, "--model", model)
        assert code == 2
        assert f"{effect}.{setting.split()[0]}" in said


def test_an_effect_that_does_not_pay_is_put_in_and_said_not_to_pay(call, tmp_path):
    log, model = written(tmp_path / "log.csv", turned()), tmp_path / "model.toml"
    model.write_text('effects = ["bias", "scale", "misalignment"]\n')
    code, found, _ = call("add", "quadratic", "--model", model, log)
    assert (code, found["pays"]) == (0, False)  # done, as asked
    assert '"quadratic"' in model.read_text()
