"""`barberpole design`: four answers, as JSON and as a table, and what it refuses."""

import json

import pytest
from barberpole.cli import run


@pytest.fixture
def call(capsys):
    """call(*words): exit code, stdout, stderr."""

    def done(*words):
        code = run(["design", *words])
        said = capsys.readouterr()
        return code, said.out, said.err

    return done


@pytest.fixture
def answer(call):
    def done(*words):
        code, out, err = call(*words, "--json")
        assert code == 0, err
        return json.loads(out)

    return done


def test_coil_of_the_thesis(answer):
    found = answer("coil", "--field-ut", "46.4", "--ohm", "70")
    assert found["current_ma"] == pytest.approx(86.0, abs=0.05)
    assert found["deviation_nt"] < 10.0
    assert found["heat_mw"] == pytest.approx(70e-3 * found["current_ma"] ** 2)
    assert found["direction_error_deg"] == pytest.approx(0.0, abs=1e-9)


def test_coil_of_the_size_asked_for(answer):
    found = answer("coil", "--region-mm", "30", "--tolerance", "0.002", "--tilt-deg", "0.5")
    again = answer(
        "coil", "--radius-mm", str(found["radius_for_region_mm"]), "--tolerance", "0.002", "--tilt-deg", "0.5"
    )
    assert again["uniform_side_mm"] == pytest.approx(30.0, rel=1e-6)


def test_shield(answer):
    found = answer("shield")
    assert found["factor_by_thesis"] == pytest.approx(found["factor"], rel=0.03)
    assert found["left_of_earth_nt"] == pytest.approx(50e3 / found["factor"])
    assert answer("shield", "--shape", "sphere")["factor"] > found["factor"]


def test_noise(answer):
    bare, amplified = answer("noise", "pybv11"), answer("noise", "pybv11", "--amplifier", "OPA4377", "--gain", "10")
    assert amplified["converter_nt_per_rthz"] == pytest.approx(bare["converter_nt_per_rthz"] / 10)
    assert bare["amplifier_nt_per_rthz"] == 0.0 < amplified["amplifier_nt_per_rthz"]
    assert amplified["total_nt_per_rthz"] > amplified["white_nt_per_rthz"]


def test_flip(answer):
    found = answer("flip", "pybv11")
    assert found["power_mw"] == pytest.approx(220e-9 * 16**2 * 200 * 1e3)
    assert found["decided_by"] == "noise"
    assert found["chosen_noise_factor"] <= found["noise_factor"]
    assert answer("flip", "pybv11", "--full-bridge")["power_mw"] == pytest.approx(4 * found["power_mw"])


@pytest.mark.parametrize("words", [("coil",), ("shield",), ("noise", "pybv11"), ("flip", "pybv11")])
def test_tables_carry_units(call, words):
    code, out, _ = call(*words)
    assert code == 0
    assert any(unit in out for unit in ("mA", "nT", "mW"))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("coil", "--radius-mm", "0"), "--radius-mm must be a positive number; got 0.0"),
        (("coil", "--tolerance", "1e-12"), "the tolerance must be between"),
        (("shield", "--shape", "cube"), "the shield must be one of cylinder, sphere"),
        (("noise", "pybv11", "--amplifier", "LM741"), "the amplifier must be one of"),
        (("flip", "pybv11", "--bandwidth-hz", "400", "--budget-mw", "5"), "the bandwidth must be at most"),
    ],
)
def test_refusals_are_one_sentence(call, words, message):
    code, out, err = call(*words)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
