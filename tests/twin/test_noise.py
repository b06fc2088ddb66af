"""Noise has the size that the data sheet says, and is a function of seed and time."""

import numpy as np
import pytest
from barberpole.twin import World
from barberpole.twin.analog import noise_level
from barberpole.twin.noise import Noise, NoiseLevel

N = 8000


def test_white_noise_is_the_density_over_the_bandwidth(board):
    level = noise_level(board, World.of(board))
    noise = Noise(level, 1, 1)
    volts = np.array([noise.at(k) for k in range(N)])
    x = board.adc.channels.x
    density_ut = 1e-3 * board.sensor.noise_nt_per_rthz
    per_ut = 1e-3 * board.sensor.sensitivity_mv_per_v_per_ut * board.sensor.bridge_v
    expected = density_ut * per_ut * np.sqrt(board.adc.sample_hz / 2.0)
    assert volts[:, x].std() == pytest.approx(expected, rel=4.0 / np.sqrt(2 * N))  # four standard errors
    assert abs(np.corrcoef(volts[:-1, x], volts[1:, x])[0, 1]) < 4.0 / np.sqrt(N)
    assert abs(np.corrcoef(volts[:, 0], volts[:, 1])[0, 1]) < 4.0 / np.sqrt(N)


def test_a_moment_has_one_noise(board):
    level = noise_level(board, World.of(board))
    straight, skipping = Noise(level, 5, 2), Noise(level, 5, 2)
    for k in range(1000):
        straight.at(k)
    skipping.at(3)
    assert np.array_equal(straight.at(1234), skipping.at(1234))
    assert not np.array_equal(Noise(level, 5, 3).at(1234), straight.at(1234))
    assert not np.array_equal(Noise(level, 6, 2).at(1234), straight.at(1234))


def test_flicker_noise_falls_with_frequency():
    """Density against power / f, averaged over half an octave around each frequency."""
    level = NoiseLevel((0.0,), (4.0,), 1.0 / 8000.0)
    noise = Noise(level, 1, 1)
    volts = np.array([noise.at(k)[0] for k in range(2**18)])
    window = np.hanning(2**15)
    pieces = volts.reshape(-1, 2**15) * window
    density = 2.0 * np.mean(np.abs(np.fft.rfft(pieces)) ** 2, axis=0) / (8000.0 * np.sum(window**2))
    f_hz = np.fft.rfftfreq(2**15, 1.0 / 8000.0)
    for f in (3.0, 10.0, 30.0, 100.0):
        near = (f_hz > f / 1.25) & (f_hz < f * 1.25)
        assert np.mean(density[near] * f_hz[near]) == pytest.approx(4.0, rel=0.5)  # few averages at the low end


def test_flicker_jumps_over_time_that_was_not_read():
    level = NoiseLevel((0.0,), (1.0,), 1.0 / 8000.0)
    near, far = [], []
    for seed in range(60):
        noise = Noise(level, seed, 1)
        first = noise.at(0)[0]
        near.append((first, noise.at(40)[0]))
        far.append((first, noise.at(8000 * 600)[0]))
    assert np.corrcoef(np.array(near).T)[0, 1] > 0.5
    assert abs(np.corrcoef(np.array(far).T)[0, 1]) < 0.45  # 60 pairs
