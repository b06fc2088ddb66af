"""Files made to break: claims that do not fit, numbers without end, other encodings, and what is no file at all.

Each ends in one sentence and exit 2, or works; time and memory stay bounded.
"""

import json
import os
import resource
import subprocess
import sys
import zlib
from base64 import b64encode
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from barberpole import files
from barberpole.arrays.keeping import read_array
from barberpole.cli import run
from barberpole.errors import LONGEST, InputError, must
from barberpole.fleet.table import META, read_fleet
from barberpole.imcs import read_driven
from barberpole.log import read_log
from barberpole.modelfile import model_text, read_model
from barberpole.paths import boards
from barberpole.plugins import TEMPLATE, compiled, load_plugin
from barberpole.records import encode, encode_json, parse
from fuzzing.many import with_meta, write_fleet
from fuzzing.one import DRIVER, driver_records, header_text, write_logs

NAMES = ("x_lsb", "y_lsb", "z_lsb")
GOOD = "t_s,x_lsb,y_lsb,z_lsb\n0,1,2,3\n1,4,5,6\n"
LIMIT_MB = 250  # of a case, beyond what Python itself takes


@pytest.fixture
def refused(capsys):
    """Run a command that must say one short sentence; what it said."""

    def said(*words) -> str:
        assert run([str(word) for word in words]) == 2
        sentence = capsys.readouterr().err.rstrip("\n")
        assert sentence.startswith("barberpole: ")
        assert sentence.isprintable()
        assert len(sentence) < LONGEST + 300
        return sentence

    return said


@pytest.fixture
def good(tmp_path):
    path = tmp_path / "good.csv"
    path.write_text(GOOD)
    return path


def table_of(rows: int) -> pa.Table:
    return pa.table(dict.fromkeys(NAMES, pa.array(np.zeros(rows))))


LINES = {
    "\r\n": GOOD.replace("\n", "\r\n").encode(),
    "\r": GOOD.replace("\n", "\r").encode(),
    "mark": b"\xef\xbb\xbf" + GOOD.encode(),
}


@pytest.mark.parametrize("how", LINES)
def test_lines_of_other_machines_are_read(tmp_path, how):
    path = tmp_path / "log.csv"
    path.write_bytes(LINES[how])
    assert read_log(path)["x_lsb"].tolist() == [1.0, 4.0]
    assert list(read_log(path).columns) == ["t_s", *NAMES]


STRANGE = {
    "UTF-16": (GOOD.encode("utf-16"), "got UTF-16"),
    "UTF-16 without a mark": (GOOD.encode("utf-16-le"), "printable"),
    "NUL bytes": (b"\0" * 5000, "printable"),
    "NUL in a name": (GOOD.replace("t_s", "t\0s").encode(), "printable"),
    "NUL in a cell": (GOOD.replace("4", "\0").encode(), r"got '\x00' in row 2"),
    "what a terminal obeys": (GOOD.replace("t_s", "\x1b[2J").encode(), "printable"),
    "nothing": (b"", "empty"),
    "quotes": (b'"' * 900_000, "field larger than"),
    "one long name": (b"x" * 200_000 + b",y\n1,2\n", "field larger than"),
    "a first line without end": (b"x_lsb,y_lsb,z_lsb" + b",c" * 1_000_000, "at most 1048576 characters"),
    "a number of a million digits": (b"x_lsb,y_lsb,z_lsb\n1,2," + b"7" * 1_000_000, "no number in any row"),
    "no measured quantity": (b"x_lsb,y_lsb,z_lsb\n1,2,3\n1,-1e308,3\n", "at most 1e+30; got -1e+308 in row 2"),
    "a row of a million cells": (b"x_lsb,y_lsb,z_lsb\n" + b"1," * 1_000_000, "only column names"),
}


@pytest.mark.parametrize("what", STRANGE)
def test_strange_bytes_in_a_csv(tmp_path, refused, what):
    data, wanted = STRANGE[what]
    path = tmp_path / "log.csv"
    path.write_bytes(data)
    assert wanted in refused("fit", path, "--model", "bias")


def test_a_first_line_of_a_gigabyte_is_not_read_whole(tmp_path, refused):
    """A file with room for 10^9 columns: such a long log is streamed."""
    path = tmp_path / "log.csv"
    with path.open("wb") as file:
        file.write(b"x_lsb,y_lsb,z_lsb")
        file.truncate(2_000_000_000)  # takes no room on the disk
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert "at most 1048576 characters" in refused("fit", path, "--model", "bias")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < LIMIT_MB << 10


@pytest.mark.parametrize("name", ["model.toml", "calibration.toml", "sensor.toml", "board.toml"])
@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("a = " + "[" * 100_000, "too deep"),
        ("a = " + "{a=" * 50_000, "too deep"),
        ("a = " + "7" * 100_000, "digits"),
        ("a = [" + "0," * 2_500_000 + "]", "at most 4194304 bytes"),
        ("a = \0", "valid TOML"),
        ("\ufeffa = 1\r\nb", "valid TOML"),
    ],
    ids=["brackets", "tables", "digits", "array", "NUL", "mark"],
)
def test_tables_without_end(tmp_path, good, refused, name, text, wanted):
    path = tmp_path / name
    path.write_text(text, newline="")
    words = {
        "model.toml": ("fit", good, "--model", path),
        "calibration.toml": ("verify", good, "--calibration", path),
        "sensor.toml": ("fit", good, "--model", "bias", "--sensor", path),
        "board.toml": ("board", "check", path),
    }
    assert wanted in refused(*words[name])


def test_a_model_that_cannot_be_kept_as_it_was_written(tmp_path, good, refused):
    """What reads a model and what writes it again are two libraries; the second takes fewer brackets."""
    path = tmp_path / "model.toml"
    path.write_text('effects = ["bias", "scale"]\n[scale]\na = ' + "[" * 150 + "]" * 150)
    before = path.read_bytes()
    refused("remove", "scale", good, "--model", path)
    assert path.read_bytes() == before
    with pytest.raises(InputError, match="nested"):
        model_text(read_model("bias"), path, path.read_text())


READERS = (
    ("fit", "AT.csv", "--model", "bias"),
    ("fit", "AT.parquet", "--model", "bias"),
    ("summary", "AT.bpr"),
    ("verify", "GOOD", "--calibration", "AT.toml"),
    ("fit", "GOOD", "--model", "AT.toml"),
    ("fit", "GOOD", "--model", "bias", "--sensor", "AT.toml"),
    ("board", "check", "AT.toml"),
    ("fleet", "report", "AT.parquet"),
    ("array", "gradient", "AT.csv", "--calibration", "AT.toml"),
    ("imcs", "GOOD", "AT.bpr", "-o", "out.csv"),
    ("diagnose", "GOOD", "--model", "bias", "--noise", "AT.csv"),
    ("report", "AT.csv", "-o", "out.html"),
)


def place(kind: str, path: Path) -> None:
    """What stands where a file should."""
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "loop":
        path.symlink_to(path.name)
    elif kind == "empty":
        path.touch()


@pytest.mark.parametrize("kind", ["folder", "pipe", "device", "loop", "empty", "absent"])
def test_what_is_no_file(tmp_path, good, refused, kind):
    """A pipe is not waited for, and a device without end not read."""
    for suffix in ("csv", "parquet", "bpr", "toml"):
        place(kind, tmp_path / f"at.{suffix}")
    for words in READERS:
        named = [word.replace("AT", str(tmp_path / "at")).replace("GOOD", str(good)) for word in words]
        assert "must be" in refused(*named)


def test_what_may_not_be_read(tmp_path, good, refused, monkeypatch):
    def denied(_path):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(files.Path, "read_bytes", denied)
    assert "got Permission denied" in refused("fit", good, "--model", "bias")


def test_a_name_that_no_file_can_have(refused):
    assert "null byte" in refused("fit", "a\0.csv", "--model", "bias")
    assert "must be" in refused("fit", "a" * 300 + ".csv", "--model", "bias")


def test_a_small_parquet_that_claims_more_than_fits(tmp_path, refused, monkeypatch):
    """Equal rows pack to nothing; what they unpack to would fill the machine. The limit is asked before reading."""
    path = tmp_path / "log.parquet"
    pq.write_table(table_of(400_000), path)
    assert path.stat().st_size < 20_000
    assert read_log(path).n == 400_000
    monkeypatch.setattr("barberpole.log_formats.FEW_NUMBERS", 1_000_000)
    for command in ("convert", "summary"):
        words = (command, path, "-o", tmp_path / "out.csv") if command == "convert" else (command, path)
        assert "400000 rows of 3 columns" in refused(*words)
    monkeypatch.setattr("barberpole.log_stream.BIG_PARQUET", 1000)
    assert "400000 rows of 3 columns" in refused("fit", path, "--model", "bias")


def test_measured_rows_are_no_claim(tmp_path, monkeypatch):
    """A reading with its noise does not pack so far: no honest log is refused."""
    monkeypatch.setattr("barberpole.log_formats.FEW_NUMBERS", 0)
    rng = np.random.default_rng(1)
    path = tmp_path / "log.parquet"
    counts = {name: rng.integers(-20, 20, 20_000) for name in NAMES}
    pq.write_table(pa.table({"t_s": np.arange(20_000) / 40.0, "state": np.ones(20_000), **counts}), path)
    assert read_log(path).n == 20_000


BOMB = """
import resource, sys
import numpy as np, pyarrow as pa, pyarrow.parquet as pq
names = ("x_lsb", "y_lsb", "z_lsb")
with pq.ParquetWriter(sys.argv[1], pa.schema([(n, pa.float64()) for n in names])) as file:
    part = pa.table({n: pa.array(np.zeros(1_000_000)) for n in names})
    for _ in range(20):
        file.write_table(part)
from barberpole.cli import run
base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
code = run(["convert", sys.argv[1], "-o", sys.argv[1] + ".csv"])
print(code, (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - base) >> 10)
"""


def test_a_parquet_bomb_takes_no_memory(tmp_path):
    path = tmp_path / "log.parquet"
    done = subprocess.run([sys.executable, "-c", BOMB, str(path)], capture_output=True, text=True, check=True)
    code, grown_mb = map(int, done.stdout.split())
    assert path.stat().st_size < 1_000_000
    assert (code, grown_mb < LIMIT_MB) == (2, True)


def test_a_frame_with_brackets_without_end_is_damage():
    assert parse(encode("H", 0, b"[" * 100_000).rstrip(b"\n")) is None


@pytest.mark.parametrize(
    ("kind", "content"),
    [
        ("T", {"unit_ma": 5.0}),
        ("T", {"unit_ma": [5.0, 5.0]}),
        ("T", {"block": -1}),
        ("T", {"points": True}),
        ("S", {"reasons": 3}),
        ("S", {"in_force_gain": [1.0, 1.0, "a"]}),
        ("S", {"gain_ut_per_unit": [1.0, 1.0, 1.0]}),
        ("S", {"temp_c": 10**400}),
        ("E", {"values": "none"}),
        ("A", {"command": ["status"]}),
    ],
)
def test_a_frame_whose_content_cannot_be_is_damage(kind, content):
    assert parse(encode_json(kind, 0, content).rstrip(b"\n")) is None


def test_metadata_that_cannot_be(tmp_path, refused):
    for at, meta in enumerate(([], {"sensor": 3}, {"result": 4}, {"result": {"reasons": "x"}}, {"events": [1]})):
        path = tmp_path / f"{at}.parquet"
        pq.write_table(table_of(5).replace_schema_metadata({b"barberpole": json.dumps(meta).encode()}), path)
        assert "must be" in refused("summary", path)


def driver_file(tmp_path, **changed):
    path = tmp_path / "driver.bpr"
    path.write_bytes(driver_records(header_text({**DRIVER, **changed})))
    return path


def test_a_driver_that_does_not_say_all(tmp_path):
    assert read_driven(driver_file(tmp_path)).current_ma.shape[0] == 3
    renamed = [["t_s", "q", 1e-6], ["from_s", "q", 1e-6], ["till_s", "q", 1e-6], *DRIVER["columns"][3:]]
    with pytest.raises(InputError, match="one with to_s"):
        read_driven(driver_file(tmp_path, columns=renamed))
    backwards = [["t_s", "q", 1e-6], ["to_s", "q", 1e-6], ["from_s", "q", 1e-6], *DRIVER["columns"][3:]]
    with pytest.raises(InputError, match="one after the other"):
        read_driven(driver_file(tmp_path, columns=backwards))
    with pytest.raises(InputError, match="three numbers"):
        read_driven(driver_file(tmp_path, ut_per_ma=1.0))


@pytest.mark.parametrize("scale", [1e-18, 1e12])
def test_a_driver_whose_points_last_no_time_or_for_ever(tmp_path, good, refused, scale):
    """The shifts to try between two clocks do not grow without end."""
    times = [[name, "q", scale] for name in ("t_s", "from_s", "to_s")]
    path = driver_file(tmp_path, columns=[*times, *DRIVER["columns"][3:]])
    rows = [f"{at / 40},{at % 7},{at % 5},{at % 3}" for at in range(200)]
    good.write_text("t_s,x_lsb,y_lsb,z_lsb\n" + "\n".join(rows))
    assert "must be" in refused("imcs", good, path, "-o", tmp_path / "out.csv")


def test_a_fleet_file_that_cannot_be(tmp_path):
    meta = json.loads(write_fleet(tmp_path, "bias,scale"))
    made = with_meta(tmp_path / "fleet.parquet")
    wrong = [
        [],
        {**meta, "format": 2},
        {**meta, "units": []},
        {**meta, "units": {**meta["units"], "bias.q": "LSB"}},
        {**meta, "units": {"bias.x": "LSB"}},
        {**meta, "model": {"effects": "bias"}},
        {**meta, "do": "harm"},
        {key: value for key, value in meta.items() if key != "key"},
    ]
    for at, content in enumerate(wrong):
        path = tmp_path / f"{at}.parquet"
        path.write_bytes(made(json.dumps(content).encode()))
        with pytest.raises(InputError):
            read_fleet(path)
    whole = pq.read_table(tmp_path / "fleet.parquet")
    pq.write_table(whole.set_column(0, "log", pa.array(range(whole.num_rows))), tmp_path / "number.parquet")
    with pytest.raises(InputError, match="of string"):
        read_fleet(tmp_path / "number.parquet")
    pq.write_table(
        whole.drop_columns(["told"]).replace_schema_metadata({META: json.dumps(meta)}), tmp_path / "t.parquet"
    )
    with pytest.raises(InputError, match="a column told"):
        read_fleet(tmp_path / "t.parquet")


def test_a_sealed_answer_that_unpacks_without_end():
    """The answer of a game comes as a file from someone else."""
    from barberpole.challenge.game import _unpacked

    packed = zlib.compress(json.dumps("a" * 50_000_000).encode())
    assert len(b64encode(packed)) < 100_000
    assert len(_unpacked(packed)) <= 1 << 20


@pytest.mark.parametrize("content", [{}, {"hidden": "lag"}, {"hidden": ["nothing of ours"]}, [1], 3])
def test_a_sealed_answer_of_others(tmp_path, refused, content):
    (tmp_path / "answer.sealed").write_bytes(b64encode(zlib.compress(json.dumps(content).encode())))
    assert "as `challenge new` wrote it" in refused("challenge", "answer", tmp_path, "lag")


def test_a_pin_of_thousands_of_digits(tmp_path, capsys):
    text = (boards() / "pybv11.toml").read_text()
    path = tmp_path / "board.toml"
    path.write_text(text.replace('set_pin = "Y1"', f'set_pin = "PA{"7" * 5000}"'))
    assert run(["board", "check", str(path)]) in (1, 2)
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize("values", ["[1, 2]", "[1, 2, nan]", f"[1, 2, {10**400}]", '"a"'])
def test_an_array_calibration_that_cannot_be(tmp_path, values):
    path = tmp_path / "array.toml"
    one = f"matrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nbias_ut = [0, 0, 0]\ngain = {values}\n"
    path.write_text(f"format = 1\n[sensor.a]\n{one}[sensor.b]\n{one}")
    with pytest.raises(InputError, match="a gap"):
        read_array(path, ("a", "b"))


@pytest.mark.parametrize(
    ("line", "wanted"), [("REQUIRES = 3", "a list of columns"), ("raise SystemExit", "a file that runs")]
)
def test_a_plugin_that_is_none(tmp_path, line, wanted):
    path = tmp_path / "mine.py"
    path.write_text(TEMPLATE.read_text().replace("NAME", "mine") + f"\n{line}\n")
    with pytest.raises(InputError, match=wanted):
        load_plugin(path)


@pytest.mark.parametrize("text", ["a = 1\0", "(" * 100_000, "a = " + "-" * 100_000 + "1"])
def test_a_plugin_that_is_no_python(text):
    with pytest.raises(InputError, match="valid Python"):
        compiled(text, Path("mine.py"))


def test_models_with_nothing_to_determine(tmp_path, refused):
    """One without parameters is refused; one whose parameters the log does not show is judged all the same."""
    write_logs(tmp_path, "bias,scale,misalignment")
    log = tmp_path / "field.csv"
    for command in ("fit", "diagnose"):
        assert "an effect that has parameters" in refused(command, log, "--model", "outliers")
    assert run(["diagnose", str(log), "--model", "cross_field"]) == 0


def test_a_sentence_tells_what_was_got_and_not_all_of_it():
    said = must("x", "short", "y" * 10_000, "a.csv")
    assert len(said) < LONGEST + 60
    assert said.endswith("(10000 characters) (a.csv)")
