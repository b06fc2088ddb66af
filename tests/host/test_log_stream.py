"""Logs read piece by piece: the same answers as from memory, the same sentences where something is wrong."""

import numpy as np
import pytest
from barberpole import log_stream
from barberpole.calibrating import calibration_of
from barberpole.calibration import write_calibration
from barberpole.challenge.record import Recipe, record
from barberpole.commands import big
from barberpole.errors import InputError
from barberpole.fit.fit import fit_log
from barberpole.fit.stream import fit_stream
from barberpole.log import read_log, write_log
from barberpole.log_stream import is_big, open_stream
from barberpole.modelfile import ModelFile
from barberpole.verify import verify
from truth.trials import BASE, log_of

NAMES = {"vector": (*BASE, "bias_temperature", "cross_field"), "constant": BASE}


@pytest.fixture(autouse=True)
def small_pieces(monkeypatch):
    """Pieces that do not fall on the edges of blocks, and a sample of a few of them."""
    for name, size in {"PIECE": 371, "BLOCK": 20_000, "STRETCH": 200, "STRETCHES": 6}.items():
        monkeypatch.setattr(log_stream, name, size)
    monkeypatch.setattr(log_stream, "BIG_CSV", 1000)
    monkeypatch.setattr(log_stream, "BIG_PARQUET", 100)


def written(tmp_path, suffix: str, **recipe):
    path = tmp_path / f"log{suffix}"
    # without coil currents: rows of a driven coil are not verified against the ambient field
    columns = {name: v for name, v in record(Recipe({}, **recipe)).items() if not name.endswith("_ma")}
    write_log(log_of(columns), path)
    return path


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
@pytest.mark.parametrize(("reference", "form"), [("vector", "pairs"), ("vector", "flips"), ("constant", "demodulated")])
def test_a_streamed_fit_is_the_fit_in_memory(tmp_path, suffix, reference, form):
    path, file = written(tmp_path, suffix, reference=reference, form=form, seed=3), ModelFile(NAMES[reference])
    whole, streamed = fit_log(read_log(path), file), fit_stream(open_stream(path), file)
    assert streamed.model.names == whole.model.names
    assert np.array_equal(streamed.free, whole.free)
    assert streamed.converged
    # what bends within the last step is left: little of a vector fit, 1e-3 standard errors here against a magnitude
    near = 1e-8 if reference == "vector" else 1e-6
    apart = near * np.maximum(np.abs(whole.p), whole.stderr) if reference == "vector" else 1e-3 * whole.stderr
    assert np.all(np.abs(streamed.p - whole.p) <= apart)
    by_one = np.outer(whole.stderr, whole.stderr)
    assert np.max(np.abs(streamed.covariance - whole.covariance) / by_one) < (1e-6 if reference == "vector" else 1e-3)
    for name in ("n", "rms_ut", "noise_lsb", "b_max_ut", "temp_c"):
        assert getattr(streamed.figures, name) == pytest.approx(getattr(whole.figures, name), rel=near), name
    assert (streamed.rms_norm_percent() is None) == (reference == "vector")
    assert streamed.rms_lsb == pytest.approx(whole.rms_lsb, rel=near)
    assert streamed.heldout_rms_lsb == pytest.approx(whole.heldout_rms_lsb, rel=1e-6)


@pytest.mark.parametrize("reference", ["vector", "constant", "magnitude"])
def test_a_streamed_log_is_verified_as_in_memory(tmp_path, reference):
    path, file = written(tmp_path, ".parquet", reference=reference, seed=4), ModelFile(BASE)
    log = read_log(path)
    calibration = calibration_of(fit_log(log, file), log, file)
    stream = open_stream(path)
    whole, streamed = verify(log, calibration), verify(stream.sample, calibration, stream)
    assert streamed.passed
    for one, other in zip(streamed.checks, whole.checks, strict=True):
        assert one.figures == pytest.approx(other.figures, rel=1e-9)


def test_the_sample_does_not_grow_and_gaps_are_left_out(tmp_path):
    columns = record(Recipe({}, seed=5))
    columns["x_lsb"][100:120] = np.nan
    path = tmp_path / "log.csv"
    write_log(log_of(columns), path)
    with path.open("a") as file:
        file.write("1,2\n")
    stream = open_stream(path)
    assert stream.sample.n <= 6 * 200
    assert (stream.rows, stream.skipped) == (2980, 21)
    assert stream.sample.sha256 == read_log(path).sha256


@pytest.mark.parametrize(
    ("column", "row", "value", "sentence"),
    [("t_s", 1900, "-5", "times that do not go back"), ("state", 2000, "3", "SET"), ("x_lsb", 2500, "abc", "abc")],
)
def test_what_is_wrong_far_into_a_log_is_said(tmp_path, column, row, value, sentence):
    path = written(tmp_path, ".csv", form="flips", seed=6)
    lines = path.read_text().splitlines()
    cells = lines[row].split(",")
    cells[[name.strip('"') for name in lines[0].split(",")].index(column)] = value
    path.write_text("\n".join([*lines[:row], ",".join(cells), *lines[row + 1 :]]) + "\n")
    with pytest.raises(InputError, match=sentence):
        open_stream(path)


def test_effects_that_need_the_log_in_one_piece_get_it_or_are_refused(tmp_path, monkeypatch, capsys):
    path, lagging = written(tmp_path, ".csv", seed=7), ModelFile((*BASE, "lag"))
    assert is_big(path)
    log, stream = big.read(path, lagging)
    assert stream is None
    assert log.n == 3000
    assert "lag needs the log in one piece" in capsys.readouterr().err
    monkeypatch.setattr("barberpole.fit.stream.IN_MEMORY", 1000)
    with pytest.raises(InputError, match="at most 1000 rows for lag"):
        big.read(path, lagging)


def test_a_calibration_from_a_stream_can_be_written(tmp_path):
    path, file = written(tmp_path, ".parquet", seed=8), ModelFile(BASE)
    log, stream = big.read(path, file)
    assert stream is not None
    calibration = calibration_of(fit_stream(stream, file), log, file)
    write_calibration(calibration, tmp_path / "c.toml")
    assert calibration.residual.n == 3000
    assert calibration.log_sha256 == read_log(path).sha256
