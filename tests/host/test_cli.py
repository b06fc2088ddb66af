"""The command line as a user or a script meets it: answers, exit codes, one sentence for every mistake."""

import json
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from barberpole.cli import run

DATA = Path(__file__).parents[3] / "shared" / "data"
LINEAR = "bias,scale,misalignment"


@pytest.fixture
def call(capsys):
    """call(*words): exit code, what stdout says, what stderr says."""

    def done(*words):
        code = run([str(word) for word in words])
        said = capsys.readouterr()
        return code, said.out, said.err

    return done


@pytest.fixture
def answer(call):
    """answer(*words): the JSON object of a command that succeeds."""

    def done(*words, code=0):
        got, out, err = call(*words, "--json")
        assert got == code, err
        return json.loads(out)

    return done


@pytest.fixture
def turned(tmp_path):
    """A log of a turned sensor with a known field: 0.3 LSB of noise, 2 LSB of bias on x, 5 % more gain on y."""
    rng = np.random.default_rng(4)
    b = rng.normal(size=(3, 900))
    b *= 48.0 / np.linalg.norm(b, axis=0)
    y = 3.0 * b * np.array([[1.0], [1.05], [1.0]]) + np.array([[2.0], [0.0], [0.0]]) + 0.3 * rng.normal(size=b.shape)
    path = tmp_path / "turned.csv"
    rows = np.vstack([np.arange(900) / 50.0, y, b, 20.0 + 5.0 * np.sin(np.arange(900) / 90.0)]).T
    np.savetxt(path, rows, "%.9g", ",", header="t_s,x_lsb,y_lsb,z_lsb,bx_ut,by_ut,bz_ut,temp_c", comments="")
    return path


def real(name):
    path = DATA / name
    if not path.exists():
        pytest.skip(f"{path} is not here: the recorded logs are not part of the project")
    return path


def refused(result, *words):
    """Exit 2, nothing on stdout, one line on stderr with these words in it."""
    code, out, err = result
    assert code == 2, (code, out, err)
    assert not out
    assert err.count("\n") == 1, err
    for word in words:
        assert word in err, err


def test_fit_gives_the_agreed_object(answer, turned):
    got = answer("fit", turned, "--model", LINEAR)
    assert {"rms_lsb", "rms_ut", "heldout_rms_lsb", "parameters", "converged", "unobservable"} <= set(got)
    assert got["rms_lsb"] == pytest.approx(0.3, rel=0.05)
    assert got["parameters"]["scale.y"]["value"] == pytest.approx(3.15, rel=1e-3)
    assert got["parameters"]["bias.x"]["unit"] == "LSB"
    assert got["parameters"]["bias.x"]["stderr"] < 0.05


def test_what_a_log_cannot_determine_is_named_and_is_no_number(answer, turned, tmp_path):
    still = tmp_path / "constant-temperature.csv"
    head, *rows = turned.read_text().splitlines()
    still.write_text("\n".join([head, *(row.rsplit(",", 1)[0] + ",21.5" for row in rows)]) + "\n")
    got = answer("fit", still, "--model", LINEAR + ",bias_temperature")
    assert got["unobservable"] == [f"bias_temperature.{axis}_1" for axis in "xyz"]
    assert not [name for name in got["parameters"] if name.startswith("bias_temperature")]


def test_fit_writes_a_calibration_that_verifies_its_own_log(call, answer, turned, tmp_path):
    cal = tmp_path / "cal.toml"
    assert call("fit", turned, "--model", LINEAR, "-o", cal)[0] == 0
    got = answer("verify", turned, "--calibration", cal)
    assert got["pass"] is True
    assert got["reasons"] == []


def test_verify_says_no_with_exit_1_when_the_gain_moved(call, answer, turned, tmp_path):
    cal, moved = tmp_path / "cal.toml", tmp_path / "moved.csv"
    call("fit", turned, "--model", LINEAR, "-o", cal)
    head, *rows = turned.read_text().splitlines()
    cells = [row.split(",") for row in rows]
    moved.write_text("\n".join([head, *(",".join([c[0], str(float(c[1]) * 1.03), *c[2:]]) for c in cells)]) + "\n")
    got = answer("verify", moved, "--calibration", cal, code=1)
    assert got["pass"] is False
    assert "residual" in got["reasons"][0]


def test_add_edits_the_model_file_and_keeps_its_comments(answer, turned, tmp_path):
    model, cal = tmp_path / "model.toml", tmp_path / "cal.toml"
    model.write_text('# our rig, south hall\neffects = ["bias", "scale"]  # to begin with\n')
    got = answer("add", "misalignment", "--model", model, turned, "-o", cal)
    assert {"rms_before_lsb", "rms_after_lsb", "heldout_before_lsb", "heldout_after_lsb", "noise_lsb", "pays"} <= set(
        got
    )
    assert got["pays"] is False  # the log has no misalignment
    text = model.read_text()
    assert "# our rig, south hall" in text
    assert "# to begin with" in text
    assert "misalignment" in text
    assert 'added = "misalignment"' in cal.read_text()


def test_adding_what_is_missing_pays(answer, turned, tmp_path):
    model = tmp_path / "model.toml"
    model.write_text('effects = ["scale"]\n')
    got = answer("add", "bias", "--model", model, turned)
    assert got["pays"] is True
    assert got["heldout_after_lsb"] < 0.5 * got["heldout_before_lsb"]
    assert got["noise_lsb"] == pytest.approx(0.3, rel=0.1)


def test_compare_and_diagnose_give_the_agreed_objects(answer, turned):
    compared = answer("compare", turned, "--model", LINEAR)
    assert compared["rms_by_axis_lsb"].keys() == {"x", "y", "z"}
    got = answer("diagnose", turned, "--model", LINEAR)
    assert got["verdict"] == "adequate"
    assert got["suspects"] == []
    assert got["cannot_be_judged"]["load_current"] == "no load_a column"


def test_diagnose_names_the_bias_that_the_model_lacks(answer, turned):
    got = answer("diagnose", turned, "--model", "scale,misalignment")
    assert got["verdict"] == "missing"
    assert got["suspects"][0]["effect"] == "bias"


def test_diagnose_of_several_logs_is_one_object_a_line_and_goes_on_past_a_bad_one(call, turned, tmp_path):
    bad = tmp_path / "bad.csv"
    bad.write_text("t_s,x_lsb\n0,1\n")
    code, out, _ = call("diagnose", turned, bad, turned, "--model", LINEAR, "--json")
    first, second, third = (json.loads(line) for line in out.splitlines())
    assert code == 2
    assert next(iter(first)) == "log"
    assert (first["log"], second["log"]) == (str(turned), str(bad))
    assert set(second) == {"log", "error"}
    assert third["verdict"] == "adequate"


def test_convert_keeps_every_number(call, answer, turned, tmp_path):
    parquet = tmp_path / "turned.parquet"
    assert call("convert", turned, "-o", parquet)[0] == 0
    assert answer("fit", parquet, "--model", LINEAR)["rms_lsb"] == answer("fit", turned, "--model", LINEAR)["rms_lsb"]


def test_every_effect_is_in_the_catalogue_with_its_equation(answer):
    listed = {entry["name"]: entry for entry in answer("effects")["effects"]}
    assert {"bias", "scale", "misalignment", "cross_field", "flip_asymmetry", "bias_temperature"} <= set(listed)
    assert all(entry["equation"] and entry["source"] for entry in listed.values())


@pytest.mark.parametrize(
    ("name", "percent"), [("hmc5883l_full_sphere.csv", (0.44, 0.48)), ("qmc5883l_strong_iron.csv", (2.7, 2.9))]
)
def test_ellipsoid_of_a_recorded_log(answer, call, tmp_path, name, percent):
    cal = tmp_path / "cal.toml"
    got = answer("fit", real(name), "--method", "ellipsoid", "-o", cal)
    assert percent[0] <= got["rms_norm_percent"] <= percent[1]
    assert answer("verify", real(name), "--calibration", cal)["pass"]
    assert call("compare", real(name), "--model", LINEAR)[0] == 0


def test_a_log_at_rest_is_refused_by_the_ellipsoid_with_a_word_on_coverage(call, tmp_path):
    cal = tmp_path / "cal.toml"
    refused(call("fit", real("hmc5883l_static_warming.csv"), "--method", "ellipsoid", "-o", cal), "all directions")
    assert not cal.exists()


def test_mistakes_are_one_sentence_with_exit_2(call, turned, tmp_path):
    refused(call("fit", turned), "--model")
    refused(call("fit", turned, "--model", "bias,gravity"), "gravity", "cross_field")
    refused(call("fit", tmp_path / "none.csv", "--model", LINEAR), "none.csv")
    refused(call("fit", turned, "--method", "magic"), "ellipsoid")
    refused(call("fit", turned, "--model", LINEAR + ",load_current"), "load_a")
    refused(call("build", "pybv12"), "pybv11")
    refused(call("verify", turned, "--calibration", turned))
    refused(call("pull", "--port", "/dev/ttyNONE", "-o", tmp_path / "a.bpr"), "/dev/ttyNONE")
    refused(call("record", "--port", "/dev/ttyNONE", "-o", tmp_path / "a.bpr"), "/dev/ttyNONE")
    refused(call("flash", tmp_path, "--port", "/dev/ttyNONE"), "build")
    refused(call("demo", "--hidden", "gravity"), "gravity", "cross_field")
    refused(call("frobnicate"), "frobnicate")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["turned.csv"]


def test_a_wrong_unit_is_named(call, turned, tmp_path):
    gauss = tmp_path / "gauss.csv"
    gauss.write_text(turned.read_text().replace("bx_ut", "bx_gauss"))
    refused(call("fit", gauss, "--model", LINEAR), "bx_ut", "gauss")


def test_version_is_a_version(call):
    code, out, _ = call("--version")
    assert code == 0
    assert re.fullmatch(r"\d+\.\d+\.\d+\S*\n", out)


def test_compare_draws_a_page_that_opens_offline(call, answer, turned, tmp_path):
    page = tmp_path / "compare.html"
    assert call("compare", turned, "--model", LINEAR, "-o", page)[0] == 0
    text = page.read_text()
    assert f"{answer('compare', turned, '--model', LINEAR)['rms_lsb']:.4g} LSB rms" in text
    assert not re.search(r"<(script|link|img|iframe)[^>]+(src|href)=", text)


def test_a_folder_that_is_a_file_is_one_sentence(call, turned):
    refused(call("demo", "-o", turned), str(turned))
    refused(call("demo", "-o", turned / "x"), str(turned))
    refused(call("convert", turned, "-o", turned / "x.csv"), str(turned))
    refused(call("effect", "new", "mine", "--folder", turned), str(turned))


def test_record_wants_a_count_that_can_be_reached(call, tmp_path):
    refused(call("record", "--port", "/dev/ptmx", "-o", tmp_path / "a.bpr", "--rows", 0), "rows")
    refused(call("record", "--port", "/dev/ptmx", "-o", tmp_path / "a.bpr", "--seconds", -1), "seconds")
    assert not list(tmp_path.iterdir())


def test_brackets_in_names_are_text(call, turned, tmp_path):
    (tmp_path / "a[").mkdir()
    odd = tmp_path / "a[" / "b].csv"  # to a reader of markup, the end of a style that never began
    code, out, _ = call("convert", turned, "-o", odd)
    assert (code, str(odd) in out) == (0, True)
    damaged = odd.read_text().splitlines()
    odd.write_text("\n".join([damaged[0], damaged[1].replace("0", "", 1)[:3], *damaged[2:]]) + "\n")
    code, _, err = call("diagnose", odd, tmp_path / "a[" / "none].csv", "--model", LINEAR)
    assert code == 2
    assert f"{tmp_path}/a[/none].csv: " in err


def test_readings_that_never_move_are_told(call, turned, tmp_path):
    still = tmp_path / "still.csv"
    head, first, *_ = turned.read_text().splitlines()
    still.write_text("\n".join([head, *([first] * 200)]) + "\n")
    for command in ("compare", "diagnose"):  # a residual that is zero is one, too
        code, _, err = call(command, still, "--model", LINEAR, "--json")
        assert code in (0, 2)
        assert err.count("\n") == (1 if code else 0)


def test_new_effect_and_convert_answer_in_json(answer, turned, tmp_path):
    assert answer("convert", turned, "-o", tmp_path / "t.parquet")["rows"] == 900
    assert answer("effect", "new", "mine", "--folder", tmp_path)["path"].endswith("mine.py")


def test_help_alone_is_no_complaint(call):
    code, out, err = call()
    assert code == 2
    assert "calibrate" in out.lower()
    assert not err


@pytest.mark.parametrize("after_s", [0.15, 0.4, 0.8, 1.2])
def test_ctrl_c_while_it_loads_is_silent(after_s):
    words = [sys.executable, "-m", "barberpole", "effects"]
    running = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    time.sleep(after_s)
    running.send_signal(signal.SIGINT)
    _, err = running.communicate(timeout=60)
    assert "host/barberpole" not in err  # a traceback names its files; early on it may be the interpreter's own


def test_hard_iron_is_the_bias_and_the_tool_says_so(call, answer, turned, tmp_path):
    code, out, err = call("fit", turned, "--model", "hard_iron,scale,misalignment", "--json")
    assert code == 0
    assert "bias.x" in json.loads(out)["parameters"]
    assert err.count("hard_iron is bias") == 1
    assert answer("effects")["aliases"] == {"hard_iron": "bias"}
    model = tmp_path / "model.toml"
    model.write_text(f"# mine\neffects = {json.dumps(LINEAR.split(','))}\n")
    before = model.read_text()
    refused(call("add", "hard_iron", "--model", model, turned), "bias", "lacks")
    assert model.read_text() == before
    assert answer("remove", "hard_iron", "--model", model, turned)["pays"] in (True, False)
    assert '"bias"' not in model.read_text()
    assert model.read_text().startswith("# mine")


def test_a_lacking_column_has_the_name_that_a_log_gives_it(call, answer, turned):
    why = answer("diagnose", turned, "--model", LINEAR)["cannot_be_judged"]
    assert why["coil_coupling"] == "no ix_ma..iz_ma column"
    refused(call("fit", turned, "--model", f"{LINEAR},coil_coupling"), "ix_ma..iz_ma", "coil_coupling")


def test_the_header_of_numpy_savetxt_is_read_and_remarks_above_it_are_passed_over(call, answer, turned, tmp_path):
    plain = answer("fit", turned, "--model", LINEAR)
    saved = tmp_path / "saved.csv"
    saved.write_text("# " + turned.read_text())
    assert answer("fit", saved, "--model", LINEAR) == plain
    saved.write_text("# my log\n" + turned.read_text())
    assert answer("fit", saved, "--model", LINEAR) == plain
    saved.write_text("# my log\n" + turned.read_text().split("\n", 1)[1])
    refused(call("fit", saved, "--model", LINEAR), "first line", "column names", "# my log")


def test_a_game_that_is_not_there_is_said_before_the_answer_is_judged(call, tmp_path):
    refused(call("challenge", "answer", tmp_path / "none", "bias"), "sealed answer")
