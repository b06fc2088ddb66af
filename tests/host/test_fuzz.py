"""Damaged files of every kind through the command line: a small sample of what `make fuzz` tries ten thousand times."""

import json
import zlib
from base64 import b64encode

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from barberpole.cli import run
from barberpole.records import encode, parse
from fuzzing.run import bench, search

CASES = 100


def test_damaged_files_end_in_a_sentence(tmp_path):
    made = bench(tmp_path)
    search(made, CASES, number=7)
    assert made.faults == []
    assert made.exits[0] > CASES // 20
    assert made.exits[2] > CASES // 2


@pytest.mark.parametrize("name", ["model.toml", "calibration.toml"])
def test_brackets_without_end(tmp_path, capsys, name):
    (tmp_path / name).write_text("a = " + "[" * 100_000)
    log = tmp_path / "log.csv"
    log.write_text("x_lsb,y_lsb,z_lsb\n1,2,3\n")
    how = ["--model" if name.startswith("model") else "--calibration", str(tmp_path / name)]
    assert run(["fit" if name.startswith("model") else "verify", str(log), *how]) == 2
    assert "too deep" in capsys.readouterr().err


def test_a_frame_with_brackets_without_end_is_damage():
    assert parse(encode("H", 0, b"[" * 100_000).rstrip(b"\n")) is None


def test_a_small_parquet_that_claims_more_than_fits(tmp_path, capsys, monkeypatch):
    """Equal rows pack to nothing; what they unpack to would fill the machine. The limit is asked before reading."""
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table(dict.fromkeys(("x_lsb", "y_lsb", "z_lsb"), pa.array(np.zeros(100_000)))), path)
    assert path.stat().st_size < 10_000
    monkeypatch.setattr("barberpole.log_formats.MOST_NUMBERS", 200_000)
    assert run(["convert", str(path), "-o", str(tmp_path / "out.csv")]) == 2
    assert "100000 rows of 3 columns" in capsys.readouterr().err


def test_a_sealed_answer_that_unpacks_without_end(tmp_path, capsys):
    """The answer of a game comes as a file from someone else."""
    from barberpole.challenge.game import _unpacked

    packed = zlib.compress(json.dumps("a" * 50_000_000).encode())
    assert len(b64encode(packed)) < 100_000
    assert len(_unpacked(packed)) <= 1 << 20


def test_a_line_of_a_million_names(tmp_path, capsys):
    path = tmp_path / "log.csv"
    path.write_text("x_lsb,y_lsb,z_lsb" + ",c" * 1_000_000 + "\n1,2,3\n")
    assert run(["fit", str(path), "--model", "bias"]) == 2
    assert "must be" in capsys.readouterr().err
