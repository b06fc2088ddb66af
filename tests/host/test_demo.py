"""The whole job: the hidden effect is found on the emulated board, added, and the error falls to the noise."""

import json
import re
from pathlib import Path

import pytest
from barberpole.cli import run

KEYS = {
    "hidden", "named", "rms_before_lsb", "rms_after_lsb", "heldout_before_lsb", "heldout_after_lsb", "noise_lsb",
    "gain_error_ppm", "selfcal_s",
}  # fmt: skip


@pytest.mark.parametrize("hidden", ["cross_field", "bias_temperature"])
def test_the_hidden_effect_is_named_and_the_error_falls_to_the_noise(hidden, tmp_path, capsys):
    assert run(["demo", "--hidden", hidden, "-o", str(tmp_path), "--json"]) == 0
    got = json.loads(capsys.readouterr().out)
    assert set(got) >= KEYS
    assert got["named"] == hidden
    assert got["heldout_after_lsb"] <= 1.10 * got["noise_lsb"]
    assert got["heldout_after_lsb"] <= got["heldout_before_lsb"] / 3.0
    assert got["board_error_after_nt"] < got["board_error_before_nt"] / 2.0
    assert max(abs(ppm) for ppm in got["gain_error_ppm"]) < 200.0
    assert got["selfcal_s"] <= 2.0
    assert got["verified"] is True
    page = (tmp_path / "demo.html").read_text()
    assert f"{got['heldout_before_lsb']:.1f} to {got['heldout_after_lsb']:.1f} LSB" in page
    assert not re.search(r"<(script|link|img|iframe)[^>]+(src|href)=", page)  # opens offline


def test_two_power_ups_of_the_demo_make_a_report(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(["demo", "-o", "demo"]) == 0
    assert Path("demo/.gitignore").read_text() == "*\n"  # `make test` after it lints nothing of it
    _report_of_two_power_ups(capsys)


def _report_of_two_power_ups(capsys):
    capsys.readouterr()
    runs = ["demo/before-selfcal.bpr", "demo/after-selfcal.bpr"]
    assert run(["report", *runs, "--calibration", "demo/calibration-2.toml", "-o", "r.html", "--json"]) == 0
    for one in json.loads(capsys.readouterr().out)["logs"]:
        assert (one["verdict"], one["fit"]) == ("accepted", None)
        # the gains that the demo gave the emulated board, as the host finds them in the board's points
        assert one["selfcal"]["host"]["gain"] == pytest.approx([1.004, 0.997, 1.002], abs=2e-4)
        assert one["selfcal"]["board_gain"] == pytest.approx(one["selfcal"]["host"]["gain"], abs=1e-3)
    page = Path("r.html").read_text()
    assert "Do the gains hold from power-up to power-up?" in page
    assert "The coil run is straight within" in page


def test_with_nothing_hidden_it_says_so(tmp_path, capsys):
    assert run(["demo", "--hidden", "none", "-o", str(tmp_path), "--json"]) == 0
    got = json.loads(capsys.readouterr().out)
    assert (got["named"], got["verdict"]) == (None, "adequate")
    assert got["heldout_after_lsb"] <= 1.10 * got["noise_lsb"]
