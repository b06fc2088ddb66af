"""Data that no closed-form method can use: each is refused with the reason, and never answered finite and wrong."""

from pathlib import Path

import numpy as np
import pytest
from barberpole.cli import run as command
from barberpole.errors import InputError
from barberpole.log import Log, write_log
from barberpole.methods.answer import Given
from barberpole.methods.registry import METHODS, find_method


def scattered(n, rng):
    """Directions without order, (3, n)."""
    v = rng.normal(size=(3, n))
    return v / np.linalg.norm(v, axis=0)


N = 600
RNG = np.random.default_rng(0)
FIELD = 50.0 * scattered(N, RNG)
NOISE = RNG.normal(size=(3, N))
TURN = np.linspace(0.0, 6.0 * np.pi, N)
YAW = np.stack([20.0 * np.cos(TURN), 20.0 * np.sin(TURN), np.full(N, 44.0)])
SCALAR = ("ellipsoid", "ellipsoid_algebraic", "iterative", "cross_axis_search", "temperature")
VECTOR = ("linear", "polynomial", "offset_coil")


def cap(degrees):
    up = RNG.uniform(np.cos(np.radians(degrees)), 1.0, N)
    about, across = RNG.uniform(0.0, 2.0 * np.pi, N), np.sqrt(1.0 - up * up)
    return 50.0 * np.stack([across * np.cos(about), across * np.sin(about), up])


def wobble(degrees):
    """A yaw turn with so much roll and pitch, of a field with a steep inclination."""
    tilt = np.radians(degrees)
    a, b = tilt * np.sin(3.3 * TURN), tilt * np.sin(2.1 * TURN + 1.0)
    x, y = 20.0 * np.cos(TURN) - 44.0 * b, -20.0 * np.sin(TURN) + 44.0 * a
    return np.stack([x, y, np.sqrt(48.33**2 - x * x - y * y)])


def spiked(y):
    y = y + 0.1 * NOISE + np.array([[5.0], [3.0], [2.0]])
    y[:, ::97] *= 8.0
    return y


def make(y, **columns):
    names = dict(zip(("x_lsb", "y_lsb", "z_lsb"), y, strict=True))
    return Log({**names, **columns}, Path("made.csv"), "0" * 64)


def log_for(name, y):
    """With the columns that the method asks for: what is wrong is the readings alone."""
    n = y.shape[1]
    extra = {
        "linear": dict(zip(("bx_ut", "by_ut", "bz_ut"), FIELD[:, :n], strict=True)),
        "offset_coil": dict(zip(("ix_ma", "iy_ma", "iz_ma"), FIELD[:, :n] / 20.0, strict=True)),
        "temperature": {"temp_c": np.linspace(10.0, 40.0, n)},
        "cross_axis_search": {"t_s": np.arange(n) / 50.0},
        "turn_over": {"turn": np.arange(n) * 4.0 // n},
    }
    return make(y, **extra.get("linear" if name == "polynomial" else name, {}))


POINTS = np.repeat(FIELD[:, :8], N // 8, axis=1)
UNUSABLE = {
    "a yaw turn": YAW,
    "a yaw turn, quiet": YAW + 0.1 * NOISE,
    "a yaw turn, noisy": YAW + NOISE,  # the ring is as thick as its noise, which an ellipsoid takes for a surface
    "a yaw turn, 3 degrees of tilt": wobble(3.0) + 0.1 * NOISE,
    "a yaw turn, 10 degrees of tilt": wobble(10.0) + NOISE,
    "a cap of 20 degrees": cap(20.0) + 0.1 * NOISE,
    "a line": np.outer([1.0, 2.0, 3.0], np.linspace(-1.0, 1.0, N)),
    "a ball of noise": 30.0 * NOISE,
    "no motion": 7.0 + 0.1 * NOISE,
    "eight points": POINTS + 0.1 * NOISE,
    "spikes": spiked(FIELD),
    "12 samples": FIELD[:, :12] + NOISE[:, :12],
}
STUCK = {
    "all zeros": np.zeros((3, N)),
    "constant": np.full((3, N), 7.0),
    "one axis stuck": FIELD * [[1.0], [1.0], [0.0]] + [[0.0], [0.0], [30.0]],
    "no number of a converter": FIELD * 1e200,
}


@pytest.mark.parametrize("name", SCALAR)
@pytest.mark.parametrize("case", UNUSABLE)
def test_scalar_methods_refuse(name, case):
    reason = r"surround|samples|rows|spikes|settle"
    with pytest.raises(InputError, match=reason):
        find_method(name).run(log_for(name, UNUSABLE[case]), Given())


@pytest.mark.parametrize("name", VECTOR)
@pytest.mark.parametrize("case", ["a yaw turn, quiet", "no motion", "a ball of noise", "spikes"])
def test_vector_methods_refuse(name, case):
    with pytest.raises(InputError, match=r"follow|spikes"):
        find_method(name).run(log_for(name, UNUSABLE[case]), Given())


@pytest.mark.parametrize("name", [m.name for m in METHODS])
@pytest.mark.parametrize("case", STUCK)
def test_every_method_refuses_what_is_stuck(name, case):
    with pytest.raises(InputError, match=r"stuck|below 1e\+12|surround|follow"):
        find_method(name).run(log_for(name, STUCK[case]), Given())


@pytest.mark.parametrize("name", ["ellipsoid", "linear"])
def test_noise_that_rises_and_falls_is_no_spike(name):
    wild = NOISE * (1.0 + 9.0 * (np.arange(N) % 200 > 180))
    assert find_method(name).run(log_for(name, 10.0 * FIELD + wild), Given()).values


@pytest.mark.parametrize("name", SCALAR[:3])
def test_errors_are_what_repeating_shows_with_few_samples(name):
    """24 shots, as of a survey: the standard errors hold although nine of the samples are used up."""
    off = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        y = 50.0 * scattered(24, rng) + 0.2 * rng.normal(size=(3, 24))
        found = find_method(name).run(make(y), Given()).values
        off += [(found[f"L.{i}{i}"].value - 1.0) / found[f"L.{i}{i}"].stderr for i in (1, 2, 3)]
    assert 0.8 < np.sqrt(np.mean(np.square(off))) < 1.4  # 120 figures; Student's 15 degrees of freedom make it 1.07


def test_the_command_says_why_and_exits_with_2(tmp_path, capsys):
    path = tmp_path / "yaw.csv"
    write_log(make(YAW + NOISE), path)
    assert command(["fit", str(path), "--method", "ellipsoid"]) == 2
    assert "turn it through all directions" in capsys.readouterr().err
