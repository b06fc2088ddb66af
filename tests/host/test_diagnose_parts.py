"""Parts of a diagnosis against the long way: least squares column by column, refits, simulated noise."""

from types import SimpleNamespace

import numpy as np
import pytest
from barberpole.diagnose import tails
from barberpole.diagnose.evidence import bic_gain, unsure_of_noise
from barberpole.diagnose.patterns import jump_patterns
from barberpole.diagnose.resting import _medians, interval
from barberpole.diagnose.still import level, still
from barberpole.diagnose.table import ALIKE, Design, heldout, multiply, parts_of, project, tabulate
from barberpole.diagnose.whitening import SEGMENT, Whitening, _joined, _segments, whitening
from barberpole.effects import Conditions
from barberpole.fit.gram import BLOCKS, FOLDS, block_edges
from barberpole.fit.noise import Noise
from barberpole.observations import Observations

N = 500
WHITE = np.array([4.0, 0.25])


@pytest.fixture(scope="module")
def columns():
    """(2, 9, N): three of the model, five of others, the residual; some act on one channel only."""
    rng = np.random.default_rng(1)
    made = rng.normal(size=(2, 9, N)) * np.array([1.0, 100.0, 0.01, 5.0, 1.0, 30.0, 2.0, 0.5, 1.0])[:, None]
    made[1, 1] = made[0, 4] = 0.0
    made[:, 6] = 0.5 * made[:, 3] + 1e-9 * made[:, 6]  # hides in another
    made[:, 8] += 0.3 * made[:, 3] + 0.2 * made[:, 4] + 2.0 * made[:, 0]
    return made


@pytest.fixture(scope="module")
def design(columns):
    made = Design(2)
    assert made.add(parts_of(columns[:, :5]), 5).tolist() == [0, 1, 2, 3, 4]
    assert made.add(parts_of(columns[:, 5:8]), 3).tolist() == [5, 6, 7]
    assert made.add(parts_of(columns[:, 8:]), 1).tolist() == [8]
    return made


BASE, LAST = np.arange(3), 8


def flat(columns, which, noise=WHITE):
    return (columns[:, which] / np.sqrt(noise)[:, None, None]).transpose(0, 2, 1).reshape(2 * N, -1)


def rss(columns, which):
    matrix, residual = flat(columns, which), flat(columns, [LAST])[:, 0]
    answer = np.linalg.lstsq(matrix, residual, rcond=None)[0]
    return np.sum((residual - matrix @ answer) ** 2), answer


def test_scores_are_those_of_least_squares(columns, design):
    table = tabulate(design, Whitening(Noise(WHITE)))
    assert (table.count, table.gram.shape) == (2 * N, (BLOCKS, 9, 9))
    found = project(table, BASE)
    left, _ = rss(columns, BASE)
    assert found.rss == pytest.approx(left, rel=1e-9)
    assert found.freedom == 2 * N - 3
    for own in ([3], [4], [3, 4], [5, 7], [3, 4, 5, 7]):
        score, rank = found.score(np.array(own))
        fitted, answer = rss(columns, [*BASE, *own])
        assert (score, rank) == (pytest.approx(left - fitted, rel=1e-7), len(own))
        assert found.weights(np.array(own))[0] == pytest.approx(answer[3:], rel=1e-6, abs=1e-9)
    both, rank = found.score(np.array([3, 6]))  # one and the same
    assert (both, rank) == (pytest.approx(found.score(np.array([3]))[0], rel=1e-6), 1)


def test_what_the_model_takes_is_not_visible(columns, design):
    hidden = np.concatenate([columns[:, [0]] + 1e-3 * columns[:, [3]], columns[:, [4]], columns[:, [LAST]]], axis=1)
    made = Design(2)
    made.add(parts_of(columns[:, :3]), 3)
    made.add(parts_of(hidden), 3)
    found = project(tabulate(made, Whitening(Noise(WHITE))), BASE)
    assert found.score(np.array([3])) == (0.0, 0)
    assert found.visibility(np.array([3])) < 0.01
    maker = flat(columns, BASE)
    free = flat(columns, [4])[:, 0]
    left = free - maker @ np.linalg.lstsq(maker, free, rcond=None)[0]
    assert found.visibility(np.array([4])) == pytest.approx(np.linalg.norm(left) / np.linalg.norm(free), rel=1e-9)
    assert found.visibility(np.array([4])) > 0.95


def test_likeness_is_the_correlation_of_what_two_can_take(columns, design):
    found = project(tabulate(design, Whitening(Noise(WHITE))), BASE)
    maker = flat(columns, BASE)
    taken = {}
    for own in (3, 5):
        one = flat(columns, [own])[:, 0]
        taken[own] = one - maker @ np.linalg.lstsq(maker, one, rcond=None)[0]
    cosine = abs(taken[3] @ taken[5]) / np.linalg.norm(taken[3]) / np.linalg.norm(taken[5])
    assert found.likeness(np.array([3]), np.array([5])) == pytest.approx(cosine, rel=1e-6)
    assert found.likeness(np.array([3]), np.array([6])) == pytest.approx(1.0, abs=1e-6)
    assert found.likeness(np.array([3, 4]), np.array([3, 4, 7])) == pytest.approx(1.0, abs=1e-9)


def test_held_out_squares_are_those_of_refits(columns, design):
    table, own = tabulate(design, Whitening(Noise(WHITE))), np.array([0, 1, 2, 4])
    block = np.tile(np.repeat(np.arange(BLOCKS), np.diff(block_edges(N))), 2)
    matrix, residual = flat(columns, own), flat(columns, [LAST])[:, 0]
    for fold, found in enumerate(heldout(table, own)):
        out = block % FOLDS == fold
        answer = np.linalg.lstsq(matrix[~out], residual[~out], rcond=None)[0]
        assert found == pytest.approx(np.sum((residual[out] - matrix[out] @ answer) ** 2), rel=1e-7)


def test_columns_are_combined_and_what_they_leave_of_noise_is_known(columns, design):
    weights = np.arange(1.0, 10.0)
    assert design.combine(weights) == pytest.approx(np.einsum("mkn,k->mn", columns, weights))
    kept = design.kept(multiply(design))
    waves = np.exp(-2j * np.pi * np.outer(np.arange(N // 2 + 1), np.arange(N)) / N)
    for channel in range(2):
        others = columns[channel, :-1]
        size = np.maximum(np.linalg.norm(others, axis=1), 1e-300)
        unit, values, _ = np.linalg.svd(others.T / size)
        basis = unit[:, : np.count_nonzero(values**2 > ALIKE)]
        power = 1.0 - np.sum(np.abs(waves @ basis) ** 2, axis=1) / N
        assert kept[channel] == pytest.approx(power, abs=1e-6)


def test_bic_is_the_likelihood_ratio_less_its_price():
    gain = bic_gain(rss=120.0, score=20.0, rank=3, count=400.0, forms=2)
    assert gain == pytest.approx(400 * np.log(120 / 100) - 3 * np.log(400) - 2 * np.log(2))
    assert bic_gain(120.0, 0.0, 0, 400.0) == 0.0
    assert np.isfinite(bic_gain(1.0, 2.0, 1, 50.0))


@pytest.mark.parametrize("n", [900, 2 * SEGMENT + 700])
def test_innovations_of_the_noise_are_white_across_every_seam(n):
    noise, rng = Noise(np.array([2.0, 9.0]), 0.08, 1.2), np.random.default_rng(3)
    f = np.fft.rfftfreq(8 * n)
    f[0] = f[1]
    level = np.sqrt(noise.white[:, None] * noise.shape(f))
    long = np.fft.irfft(np.fft.rfft(rng.normal(size=(2, 8 * n)), axis=1) * level, 8 * n, axis=1)
    filtered = whitening(noise, n)
    assert len(filtered.filter) == 4
    for channel in range(2):
        rows = long[channel, : n * 7].reshape(7, n)
        out = filtered.apply(channel, rows - rows.mean(axis=1, keepdims=True))
        assert np.var(out) == pytest.approx(1.0, abs=0.06)
        power = np.mean(np.abs(np.fft.rfft(out, axis=1)) ** 2, axis=0) / n
        for part in np.array_split(power[3:-1], 8):
            assert np.mean(part) == pytest.approx(1.0, abs=6.0 / np.sqrt(7 * part.size) + 0.12)
        assert np.var(rows) > 1.5 * noise.white[channel]
    assert whitening(Noise(WHITE), n).filter == ()


def test_segments_join_to_what_they_were_cut_from():
    for n in (10, SEGMENT, SEGMENT + 1, 3 * SEGMENT - 5):
        rows = np.arange(2.0 * n).reshape(2, n)
        assert np.array_equal(_joined(_segments(rows), n), rows)


def test_turning_noise_is_whitened_by_its_normal():
    rng, n = np.random.default_rng(5), 2000
    noise = Noise(np.array([1.0, 1.0, 1.0]), 0.1, 1.0)
    f = np.fft.rfftfreq(4 * n)
    f[0] = f[1]
    axes = np.fft.irfft(np.fft.rfft(rng.normal(size=(3, 4 * n)), axis=1) * np.sqrt(noise.shape(f)), 4 * n, axis=1)[
        :, :n
    ]
    phase = 2 * np.pi * 25 * np.arange(n) / n
    normal = np.array([np.cos(phase), np.sin(phase), 0 * phase])
    out = whitening(noise, n, normal).apply(0, np.sum(normal * axes, axis=0)[None])[0]
    assert np.var(out) == pytest.approx(1.0, abs=0.15)
    likeness = [np.mean(out[k:] * out[:-k]) for k in range(1, 90)]
    assert np.max(np.abs(likeness)) < 5.0 / np.sqrt(n)


def test_outliers_giants_and_jumps_are_told_from_noise():
    rng, n = np.random.default_rng(6), 3000
    noise = rng.normal(size=(3, n)) * [[1.0], [5.0], [0.1]]
    red = np.cumsum(rng.normal(size=(3, n)), axis=1)
    for coloured in (False, True):
        assert tails.wrong_readings(noise, coloured) < tails.LIKELIER
    assert tails.wrong_readings(red, True) < tails.LIKELIER_COLOURED
    assert np.all(tails.jumps(red) < tails.LIKELIER)
    wrong = noise.copy()
    wrong[1, ::100] += 40.0
    assert tails.wrong_readings(wrong, False) > 4 * tails.LIKELIER
    assert tails.wrong_readings(red + wrong - noise, True) > tails.LIKELIER_COLOURED
    clumped = noise.copy()
    clumped[1, 1000:1100] *= 8.0
    assert tails.wrong_readings(clumped, False) == 0.0
    assert tails.lonely_giants(noise) == 0.0
    giants = noise.copy()
    giants[0, [10, 500, 900]] += 60.0
    giants[2, 40] -= 9.0
    assert tails.lonely_giants(giants) == 4 * tails.GIANT**2 / 2
    giants[0, 1000:1100] += np.tile([60.0, -60.0], 50)
    assert tails.lonely_giants(giants) == 0.0  # they stand together
    steps = noise.copy()
    steps[2] += 0.8 * (np.arange(n) // 500 % 2)
    assert (tails.jumps(steps) > tails.LIKELIER).tolist() == [False, False, True]
    assert not tails.jumps(steps[:, :300]).any()
    phase = 2 * np.pi * np.arange(n) / n
    turning = np.array([np.cos(phase), np.sin(phase), 0 * phase])  # one turn: each step's normal is like the last one's
    late = noise[:1] + 6.0 * (np.arange(n) > n // 2) * (np.arange(n) // 200 % 2)
    assert tails.jumps(late, turning)[0] > tails.LIKELIER
    rattling = np.where(np.arange(n) // 20 % 2, turning, turning[[2, 0, 1]])
    assert tails.jumps(late, rattling)[0] == 0.0  # hardly anything lies between turns


def test_a_jump_is_said_with_its_chance():
    rng, n = np.random.default_rng(9), 1800
    residual = rng.normal(size=(3, n))
    residual[1] += 4.0 * (np.arange(n) // 300 % 2)
    evidence = SimpleNamespace(
        ground=SimpleNamespace(residual=residual, axes=("x", "y", "z"), normal=None),
        fit=SimpleNamespace(problem=SimpleNamespace(seen=SimpleNamespace(y=residual))),
    )
    (found,) = jump_patterns(evidence)
    gain = tails.jumps(residual)[1]
    assert tails.LIKELIER < gain < 600.0
    assert (found.axis, found.against, found.p_value) == ("y", "t_s", pytest.approx(np.exp(-gain), rel=1e-9))
    assert found.rms_lsb == pytest.approx(np.sqrt(np.mean(residual[1] ** 2)))


def test_levels_of_a_converter_are_spread_by_one_step():
    readings = np.array([np.arange(400) // 40 * 0.5, np.linspace(0, 1, 400), np.zeros(400)])
    spread = tails.dither(readings, 3)
    assert (np.abs(spread).max(axis=1) <= [0.5, 0.0, 0.0]).all()
    assert spread[0].std() == pytest.approx(0.5 / np.sqrt(3), rel=0.1)
    assert tails.dither(readings, 1).shape == (1, 400)
    assert np.abs(tails.dither(readings, 1)).max() > 0.4


def at_rest(y, reference="constant", **logged):
    n = y.shape[1]
    at = Conditions(**({"state": np.zeros(n)} | logged))
    return Observations(y, at, None, None, np.arange(n), reference, False)


def test_a_sensor_moved_if_one_axis_did():
    rng, n = np.random.default_rng(8), 600
    t_s, temp_c = np.arange(n) / 50.0, 25.0 + 5.0 * np.sin(np.arange(n) / 90.0)
    drift = rng.normal(size=(3, n)) + np.array([[2.0], [-1.0], [0.5]]) * (temp_c - 25.0)
    found = still(at_rest(drift, t_s=t_s, temp_c=temp_c))
    assert found is not None
    assert found.causes == ("bias_temperature", "sensitivity_temperature")
    assert found.noise_lsb == pytest.approx(1.0, rel=0.05)
    assert found.rms_lsb == pytest.approx(np.sqrt(np.mean(np.var(drift, axis=1))), rel=1e-9)
    assert [(p.axis, p.against) for p in found.patterns] == [(a, "temp_c") for a in "xyz"]
    assert [p.rms_lsb for p in found.patterns] == pytest.approx([2 * 3.5, 3.5, 1.75], rel=0.15)
    moved = drift + np.array([[0.0], [6.0], [0.0]]) * np.sin(np.arange(n) / 13.0)
    assert still(at_rest(moved, t_s=t_s, temp_c=temp_c)) is None
    quiet = still(at_rest(rng.normal(size=(3, n)), t_s=t_s))
    assert (quiet.causes, quiet.patterns) == ((), ())
    assert "turn it" in quiet.advice
    assert still(at_rest(drift[:, :19])) is None
    assert still(at_rest(drift, reference="vector", t_s=t_s, temp_c=temp_c)) is None


def test_each_state_has_its_own_level():
    state = np.tile([1.0, -1.0], 50)
    y = np.random.default_rng(1).normal(size=(3, 100)) + 7.0 * state + 3.0
    out = level(at_rest(y, state=state))
    for kind in (1.0, -1.0):
        assert out[:, state == kind].mean(axis=1) == pytest.approx(np.zeros(3), abs=1e-12)
    assert np.diff(out[:, ::2]) == pytest.approx(np.diff(y[:, ::2]))
    blocks = _medians(y, state, 5)
    assert blocks.shape == (3, 2, 5)
    assert blocks[1, 0, 2] == np.median(y[1, 40:60][state[40:60] == -1.0])
    gone = np.where(np.arange(100) < 20, 1.0, state)
    assert np.isnan(_medians(y, gone, 5)[:, 0, 0]).all()


def test_interval_is_the_mean_time_between_readings():
    y = np.zeros((3, 4))
    assert interval(at_rest(y, t_s=np.array([2.0, 2.1, 2.5, 3.5]))) == pytest.approx(0.5)
    assert interval(at_rest(y)) == 0.0
    assert interval(SimpleNamespace(at=SimpleNamespace(t_s=np.array([4.0])), y=y[:, :1])) == 0.0


def test_a_short_scalar_log_is_unsure_of_a_colour_that_it_may_hide():
    red = np.cumsum(np.random.default_rng(4).normal(size=(1, 1000)), axis=1)

    def evidence(columns, residual=red, noise=None, normal=red):
        return SimpleNamespace(
            white=SimpleNamespace(noise=noise or Noise(np.ones(1), source="residual")),
            ground=SimpleNamespace(residual=residual, normal=normal),
            table=SimpleNamespace(count=1000.0),
            design=SimpleNamespace(count=columns),
        )

    assert unsure_of_noise(evidence(126))  # fewer than eight residuals a column
    assert not unsure_of_noise(evidence(124))
    assert not unsure_of_noise(evidence(126, residual=np.random.default_rng(5).normal(size=(1, 1000))))
    coloured = Noise(np.ones(1), 0.1, source="residual")
    assert unsure_of_noise(evidence(10, noise=coloured))
    assert not unsure_of_noise(evidence(10, noise=Noise(np.ones(1), 0.1, source="rest")))  # that was measured
    assert not unsure_of_noise(evidence(126, normal=None))  # three residuals a sample tell it
