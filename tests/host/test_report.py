"""The page to send: it opens offline, says the verdict first, and its numbers are those of --json."""

import html
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from barberpole.challenge.record import Recipe, record
from barberpole.cli import run
from barberpole.log import write_log
from barberpole.report.cited import Answer
from barberpole.summary import summarise
from truth.trials import log_of

LINEAR = "bias,scale,misalignment"
CHROMIUM = shutil.which("chromium")


@pytest.fixture
def call(capsys):
    """call(*words): exit code, what stdout says, what stderr says."""

    def done(*words):
        code = run([str(word) for word in words])
        said = capsys.readouterr()
        return code, said.out, said.err

    return done


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A bent log, one of noise with a known magnitude, and one at rest."""
    path = tmp_path_factory.mktemp("logs")
    write_log(log_of(record(Recipe({"quadratic": 4.0}, seed=2, rows=1500))), path / "bent.csv")
    write_log(log_of(record(Recipe({}, reference="magnitude", seed=3, rows=1500))), path / "good.csv")
    return path


@pytest.fixture(scope="module")
def page(folder):
    """The report of both logs against a calibration of the second effect's history, its text and its --json."""
    cal, text = folder / "cal.toml", folder / "report.html"
    model = folder / "model.toml"
    model.write_text('effects = ["bias", "scale", "misalignment"]\n')
    assert run(["fit", str(folder / "bent.csv"), "--model", LINEAR, "-o", str(cal)]) == 0
    words = ["report", str(folder / "bent.csv"), str(folder / "good.csv"), "--calibration", str(cal), "-o", str(text)]
    assert run(words) == 0
    return words, text.read_text()


def carried(text: str) -> dict:
    """The object that the page carries."""
    found = re.search(r'<script type="application/json" id="answer">(.*?)</script>', text, re.DOTALL)
    assert found
    return json.loads(found[1])


def cited(text: str) -> list[tuple[str, str, str]]:
    """(value, pointer, as shown) of every number that the page cites."""
    found = re.findall(r'<data value="([^"]*)" data-from="([^"]*)">(.*?)</data>', text)
    return [(value, html.unescape(pointer), html.unescape(shown)) for value, pointer, shown in found]


def at(answer, pointer: str):
    """RFC 6901."""
    for key in pointer.split("/")[1:]:
        key = key.replace("~1", "/").replace("~0", "~")
        answer = answer[int(key)] if isinstance(answer, list) else answer[key]
    return answer


def test_the_numbers_of_the_page_are_those_of_json(page, call):
    words, text = page
    code, out, err = call(*words, "--json")
    assert code == 0, err
    said = json.loads(out)
    assert carried(text) == said
    numbers = cited(text)
    assert len(numbers) > 80
    for value, pointer, shown in numbers:
        told = at(said, pointer)
        assert value == ("" if told is None else repr(told)), pointer
        if isinstance(told, int | float):
            share = 100.0 if pointer.endswith("heldout_drop") else 1.0
            assert float(shown) == pytest.approx(share * told, rel=0.06, abs=1e-12), pointer  # two figures at least
    for pointer in ("/logs/0/fit/rms_lsb", "/logs/0/noise_lsb", "/logs/0/fit/parameters/bias.x/value"):
        assert any(p == pointer for _, p, _ in numbers), pointer


def test_it_says_the_same_as_the_single_commands(page, folder, call):
    _, text = page
    first = carried(text)["logs"][0]
    model = ("--model", LINEAR)
    fit = json.loads(call("fit", folder / "bent.csv", *model, "--json")[1])
    assert first["fit"]["heldout_rms_lsb"] == pytest.approx(fit["heldout_rms_lsb"], rel=1e-9)
    assert first["fit"]["parameters"].keys() == fit["parameters"].keys()
    said = json.loads(call("diagnose", folder / "bent.csv", *model, "--json")[1])
    assert first["verdict"] == said["verdict"]
    for one, other in zip(first["diagnosis"]["suspects"], said["suspects"], strict=True):
        assert one == {name: pytest.approx(v, rel=1e-9) if isinstance(v, float) else v for name, v in other.items()}
    assert first["path"][-1]["rms_lsb"] == pytest.approx(said["suspects"][-1]["rms_after_lsb"], rel=1e-9)


def test_the_verdict_comes_first_and_titles_answer(page):
    _, text = page
    body = re.sub(r"<[^>]+>", "", html.unescape(text.split("<main>")[1].split("</main>")[0]))
    assert body.index("1 missing; 1 adequate") < body.index("What does each log say?")
    assert body.index("quadratic is missing. The model leaves") < body.index("Does the model follow the measurement?")
    assert re.search(r"y fails most against field_y: quadratic in the y field, \+\d+ LSB at ±\d+ µT", body)
    assert re.search(r"The error falls from [\d.]+ to [\d.]+ LSB, the noise floor", body)
    assert "No parameter has changed" in body  # the calibration is of this very log


def test_it_opens_offline_and_small(page):
    _, text = page
    assert len(text.encode()) < 8_000_000
    assert not re.search(r"<(script|link|img|iframe)[^>]+(src|href)=", text)
    assert "default-src 'none'" in text  # the browser itself refuses to fetch anything
    assert text.count("plotly.js v") == 1
    for height in re.findall(r'class="plot" [^>]*style="height:(\d+)px"', text):
        assert int(height) > 100  # kept free before anything is drawn


def test_each_picture_has_a_sentence(page):
    _, text = page
    ids = re.findall(r'<div class="plot" id="p(\d+)"[^>]*aria-describedby="s(\d+)"', text)
    assert len(ids) > 10
    for plot, sentence in ids:
        said = re.search(rf'<figcaption id="s{sentence}">(.*?)</figcaption>', text, re.DOTALL)
        assert plot == sentence
        assert said
        assert len(said[1]) > 20


def test_it_says_where_it_comes_from_and_the_command_repeats_it(page, tmp_path):
    words, text = page
    footer = html.unescape(text.split("<footer>")[1].split("</footer>")[0])
    assert carried(text)["logs"][0]["sha256"] in footer
    again = footer.split("repeat it: barberpole ")[1].strip().split()
    assert again == words
    copy = tmp_path / "again.html"
    assert run([*again[:-1], str(copy)]) == 0
    same = copy.read_text().replace(str(copy), words[-1])
    assert same == text


def test_noise_at_rest_and_a_model_file(folder, call, tmp_path):
    rest = tmp_path / "rest.csv"
    rng, rows = np.random.default_rng(0), 2000
    table = np.vstack([np.arange(rows) / 40.0, 300.0 + 2.0 * rng.normal(size=(3, rows))]).T
    np.savetxt(rest, table, "%.9g", ",", header="t_s,x_lsb,y_lsb,z_lsb", comments="")
    words = ("report", folder / "bent.csv", "--model", folder / "model.toml", "--noise", rest, "--json")
    if not (folder / "model.toml").exists():
        (folder / "model.toml").write_text('effects = ["bias", "scale", "misalignment"]\n')
    code, out, err = call(*words)
    assert code == 0, err
    got = json.loads(out)["logs"][0]
    assert got["comparison"]["noise_lsb"] == pytest.approx(2.0, rel=0.05)
    assert got["verdict"] == "missing"


def test_a_log_at_rest_still_makes_a_report(call, tmp_path):
    rest = tmp_path / "rest.csv"
    rng = np.random.default_rng(0)
    table = np.vstack([np.arange(600) / 40.0, 300.0 + 2.0 * rng.normal(size=(3, 600))]).T
    np.savetxt(rest, table, "%.9g", ",", header="t_s,x_lsb,y_lsb,z_lsb", comments="")
    code, _, err = call("report", rest, "-o", tmp_path / "r.html")
    assert code == 0, err
    text = (tmp_path / "r.html").read_text()
    assert "Inconclusive: The sensor did not move" in text
    assert carried(text)["logs"][0]["fit"] is None


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("nowhere.csv",), "nowhere.csv"),
        (("bent.csv", "--model", "nonsense"), "nonsense"),
        (("bent.csv", "--calibration", "bent.csv"), "bent.csv"),
        (("bent.csv", "-o", "no/such/folder/r.html"), "folder"),
    ],
)
def test_bad_input_is_one_sentence_and_writes_nothing(words, says, folder, call, monkeypatch):
    monkeypatch.chdir(folder)
    before = sorted(folder.iterdir())
    code, out, err = call("report", *words)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert says in err
    assert sorted(folder.iterdir()) == before


def test_a_citation_points_where_it_says():
    answer = Answer({"a/b": [{"x~y": 1.25}], "gone": None})
    assert str(answer.say("{a/b 0 x~y:2} <LSB>")) == (
        '<data value="1.25" data-from="/a~1b/0/x~0y">1.2</data> &lt;LSB&gt;'
    )
    assert "not known" in answer.say("{gone}")


def test_a_count_is_told_with_all_its_digits():
    assert ">15948</data> rows" in Answer({"rows": 15948}).say("{rows} rows")


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium here")
def test_the_browser_draws_every_picture(page, folder):
    _, text = page
    drawn = subprocess.run(
        [str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=8000", "--dump-dom",
         (folder / "report.html").as_uri()],
        capture_output=True, text=True, timeout=120, check=True,
    ).stdout  # fmt: skip
    assert drawn.count('class="main-svg"') >= text.count('class="plot"')
    assert len(re.findall(r'class="plot js-plotly-plot"', drawn)) == text.count('class="plot"')


def test_summary_says_what_a_log_holds(folder, call):
    code, out, err = call("summary", folder / "bent.csv", "--json")
    assert code == 0, err
    got = json.loads(out)
    assert (got["rows"], got["reference"], got["form"]) == (1500, "vector", "SET and RESET in turns")
    assert got["rate_hz"] == pytest.approx(40.0)
    assert got["flips"] == 59  # a flip every 25 rows
    assert got["directions"] > 50
    assert next(c for c in got["columns"] if c["name"] == "bx_ut")["unit"] == "µT"
    assert "cross_field" in got["shows"]
    told = call("summary", folder / "bent.csv")[1]
    assert "the field is known" in told
    assert len(told.splitlines()) < 40  # one screen


def test_summary_finds_gaps_spikes_and_what_cannot_be_shown(tmp_path, call):
    rng = np.random.default_rng(1)
    t = np.arange(800) / 50.0
    t[400:] += 2.0
    angle = 2 * np.pi * t / 8.0
    y = 100.0 * np.stack([np.cos(angle), np.sin(angle), np.zeros(800)]) + rng.normal(size=(3, 800))
    y[1, 100] += 60.0
    y[1, 300] -= 60.0
    path = tmp_path / "flat.csv"
    rows = np.vstack([t, y, np.full(800, 25.0)]).T
    np.savetxt(path, rows, "%.9g", ",", header="t_s,x_lsb,y_lsb,z_lsb,temp_c", comments="")
    got = json.loads(call("summary", path, "--json")[1])
    assert (got["gaps"], got["spikes"]) == (1, {"x": 0, "y": 2, "z": 0})
    assert got["longest_gap_s"] == pytest.approx(2.02)
    assert got["directions"] < 36
    assert "only" in got["cannot_show"]["cross_field"]
    assert got["cannot_show"]["load_current"] == "no load_a column"
    assert "temperature" in got["cannot_show"]["bias_temperature"]


def test_steps_and_turns_are_no_spikes():
    log = log_of(record(Recipe({}, seed=4, rows=2000)))
    assert sum(summarise(log).spikes.values()) == 0


def test_pairs_with_a_bridge_offset_are_not_taken_for_rest(tmp_path, call):
    rng = np.random.default_rng(2)
    b = rng.normal(size=(3, 500))
    b *= 50.0 / np.linalg.norm(b, axis=0)
    offset = np.array([[4000.0], [-3000.0], [5000.0]])
    noise = rng.normal(size=(2, 3, 500))
    names = [f"{a}_{s}_lsb" for s in ("set", "reset") for a in "xyz"]
    rows = np.vstack([np.arange(500) / 50.0, 10 * b + offset + noise[0], -10 * b + offset + noise[1]]).T
    path = Path(tmp_path) / "pairs.csv"
    np.savetxt(path, rows, "%.9g", ",", header=",".join(["t_s", *names]), comments="")
    assert json.loads(call("summary", path, "--json")[1])["still_rows"] == 0
    said = json.loads(call("diagnose", path, "--model", LINEAR, "--json")[1])
    assert "did not move" not in said["next_experiment"]
