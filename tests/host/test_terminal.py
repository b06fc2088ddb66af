"""What a person sees in a terminal of 80 columns: nothing broken within a word, numbers to the digits that count."""

import fcntl
import io
import json
import os
import pty
import re
import struct
import subprocess
import sys
import termios

import numpy as np
import pytest
from barberpole.cli import run
from barberpole.commands.console import folded
from barberpole.numbers import chance, with_error
from rich.console import Console

CONTROL = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
WIDTH = 80


def seen(*words: str) -> list[str]:
    """The lines that a terminal of WIDTH columns is sent."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 40, WIDTH, 0, 0))
    environment = os.environ | {"TERM": "xterm"}
    environment.pop("COLUMNS", None)
    command = [sys.executable, "-m", "barberpole", *words]
    child = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=environment)
    os.close(theirs)
    sent = b""
    while True:
        try:
            sent += os.read(ours, 65536)
        except OSError:  # the last one has closed it
            break
    os.close(ours)
    child.wait()
    return CONTROL.sub("", sent.decode()).replace("\r\n", "\n").splitlines()


@pytest.fixture
def turned(tmp_path):
    """A log whose only lack is the bias, of readings that are whole counts."""
    rng = np.random.default_rng(4)
    b = rng.normal(size=(3, 900))
    b *= 48.0 / np.linalg.norm(b, axis=0)
    y = np.round(30.0 * b + np.array([[200.0], [0.0], [0.0]]) + rng.normal(size=b.shape))
    path = tmp_path / "turned.csv"
    rows = np.vstack([np.arange(900) / 50.0, y, b]).T
    np.savetxt(path, rows, "%.9g", ",", header="t_s,x_lsb,y_lsb,z_lsb,bx_ut,by_ut,bz_ut", comments="")
    return path


def test_a_sentence_is_folded_at_words_on_a_terminal_and_whole_in_a_pipe():
    sentence = "next: record /a/path-that-is-longer-than-the-terminal/log.csv at rest for 60 s"
    narrow = Console(file=io.StringIO(), force_terminal=True, width=24)
    lines = folded(sentence, narrow).splitlines()
    assert lines[0] == "next: record"
    assert "  /a/path-that-is-longer-than-the-terminal/log.csv" in lines
    assert " ".join(line.strip() for line in lines) == sentence
    assert folded(sentence, Console(file=io.StringIO(), width=24)) == sentence


@pytest.mark.parametrize(
    "words", [("diagnose", "turned.csv", "--model", "scale"), ("fit", "turned.csv", "--model", "x")]
)
def test_no_line_is_wider_than_the_terminal(turned, monkeypatch, words):
    monkeypatch.chdir(turned.parent)
    lines = seen(*words)
    assert [line for line in lines if len(line) > WIDTH and "━" not in line] == []
    assert any(line.startswith("  ") for line in lines)  # something had to be folded


def test_a_diagnosis_ends_with_the_command_that_goes_on(turned, capsys):
    assert run(["diagnose", str(turned), "--model", "scale"]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == f"put it in: barberpole add bias --model scale {turned}"
    assert run(last.split()[4:]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "go on with --model scale,bias"


def test_adding_tells_the_noise_that_a_comparison_tells(turned, capsys):
    assert run(["add", "bias", "--model", "scale", str(turned)]) == 0
    noise = re.search(r"noise +([\d.]+)", capsys.readouterr().out)
    assert noise
    assert float(noise.group(1)) == pytest.approx(np.sqrt(1.0 + 1.0 / 12.0), rel=0.05)  # with that of rounding


@pytest.mark.parametrize(
    ("value", "error", "shown"),
    [
        (2818.34, 121.0, ("2820", "120")),
        (0.0117974, 0.00069, ("0.01180", "0.00069")),
        (6261.57, 10.9, ("6262", "11")),
        (-45.2517, 0.19, ("-45.25", "0.19")),
        (50.0, float("nan"), ("50", "")),
        (1.5e-9, 2e-11, ("1.5e-09", "2e-11")),
        (-3.77678e-5, 3.1e-7, ("-3.777e-05", "3.1e-07")),
        (1e-9, 3e-7, ("1e-09", "3e-07")),
        (0.000318, 0.0021, ("0.00032", "0.0021")),
        (0.0, 0.0021, ("0.0000", "0.0021")),
    ],
)
def test_a_value_is_shown_to_the_digits_that_its_error_leaves(value, error, shown):
    assert with_error(value, error) == shown


def test_no_chance_is_told_that_cannot_be_computed():
    assert [chance(p) for p in (1e-300, 0.0, 2.24e-8)] == ["<1e-300", "<1e-300", "2.2e-08"]


def test_a_calibration_given_as_a_model_is_told_where_it_belongs(turned, tmp_path, capsys):
    made = str(tmp_path / "cal.toml")
    assert run(["fit", str(turned), "--model", "bias,scale", "-o", made]) == 0
    assert run(["compare", str(turned), "--model", made]) == 2
    assert "must be one that lists effects; got a calibration (`verify --calibration`" in capsys.readouterr().err


def test_a_word_that_is_no_choice_is_told_the_choices(capsys):
    assert run(["command", "dance", "--port", "P"]) == 2
    assert "Invalid value for 'asked': 'dance' is not one of 'status'" in capsys.readouterr().err


def test_few_careful_orientations_are_not_called_one_sided(tmp_path, capsys):
    """24 shots can see a third of 72 directions at most."""
    rng = np.random.default_rng(5)
    b = rng.normal(size=(3, 24))
    b *= 48.0 / np.linalg.norm(b, axis=0)
    path = tmp_path / "shots.csv"
    np.savetxt(path, b.T, "%.6g", ",", header="x_lsb,y_lsb,z_lsb", comments="")
    assert run(["summary", str(path), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert {"bias", "scale", "misalignment"} <= set(said["shows"])
    assert said["spikes"] == {"x": 0, "y": 0, "z": 0}
    np.savetxt(path, np.abs(b).T, "%.6g", ",", header="x_lsb,y_lsb,z_lsb", comments="")
    assert run(["summary", str(path), "--json"]) == 0
    assert "bias" in json.loads(capsys.readouterr().out)["cannot_show"]
