"""Two routes to one answer: the effects against energies, series, limits and figures of the sources.

| formula                       | meets                                         | where              |
|-------------------------------|-----------------------------------------------|--------------------|
| cross_field, both states      | the minimum of the film's energy (3.2)        | everywhere         |
| cross_field, one state        | H_y / (1 + k H_x)  (3.14)                     | k -> 0, order 2    |
| cross_field, demodulated      | the series (3.34)                             | k -> 0, order 4    |
| saturation                    | a hyperbolic tangent; cubic                   | x -> 0, order 4    |
| lag                           | a resistor and a capacitor                    | dt -> 0, order 1   |
| hysteresis                    | a sample-by-sample play; its loop height      | everywhere         |
| coil_heating                  | Newton's law of cooling                       | dt -> 0            |
| soft_iron, misalignment       | the matrices of 4.1-4.6                       | everywhere         |
"""

from dataclasses import replace

import numpy as np
import pytest
from barberpole.effects import Conditions, Setup, find_effect
from barberpole.effects.play import play
from barberpole.model import compose
from scipy.optimize import minimize_scalar

GAUSS = 100.0  # µT


def apply(name: str, field, p, **known):
    """One effect's output (3, n)."""
    return np.asarray(find_effect(name).forward(np.asarray(field, float), p, Conditions(**known)))


def energy_reading(own: float, easy: float, anisotropy: float, state: float) -> float:
    """What the bridge reports from the angle of least energy (3.2), with no torque equation and no series."""

    def energy(angle: float) -> float:
        return -(own * np.sin(angle) + state * easy * np.cos(angle)) + 0.5 * anisotropy * np.sin(angle) ** 2

    found = minimize_scalar(energy, bounds=(-np.pi / 4, np.pi / 4), method="bounded", options={"xatol": 1e-12})
    return anisotropy * np.sin(found.x) * np.cos(found.x)


@pytest.mark.parametrize("state", [1.0, -1.0])
@pytest.mark.parametrize("anisotropy", [300.0, 800.0, 2000.0])
def test_cross_field_is_the_state_of_least_energy(anisotropy: float, state: float):
    field = np.random.default_rng(0).uniform(-60, 60, (3, 40))
    out = apply("cross_field", field, np.full(3, 1 / anisotropy), state=state)
    for die, easy in enumerate(Conditions().easy_axis):
        found = [energy_reading(own, e, anisotropy, state) for own, e in zip(field[die], field[easy], strict=True)]
        assert np.allclose(out[die], found, atol=3e-5)  # a minimum is known to the square root of the rounding


def shrinks(errors, order: int) -> bool:
    """Whether errors, at arguments halved each time, fall as that power of the argument."""
    return bool(np.all(np.abs(np.log2(np.array(errors[:-1]) / errors[1:]) - order) < 0.1))


def relative_errors(approximation, ks, state):
    own, easy = 37.0, -52.0
    errors = []
    for k in ks:
        out = [apply("cross_field", [[own], [easy], [0.0]], np.full(3, k), state=s)[0, 0] for s in state]
        errors.append(abs(np.mean(out) / approximation(own, easy, 1 / k) - 1.0))
    return errors


def test_first_order_limit_of_one_magnetisation():
    """Eq. 3.14, with a = H_k: what is left falls as the square of the field over H_k."""
    ks = 1 / 1600.0 * 0.5 ** np.arange(4)
    assert shrinks(relative_errors(lambda own, easy, h: own / (1 + easy / h), ks, (1.0,)), 2)


def series_334(own: float, easy: float, h: float) -> float:
    """Eq. 3.34 as printed, with a = H_k."""
    x1, x2 = own / (easy + h), own / (easy - h)
    return h / 4 * (x1 - x2) * (2 - x2 * x2 - x1 * x1 - x1 * x2)


def test_flipped_limit():
    """Eq. 3.34 holds to the fourth power of the field over H_k; without the cross-field it would be the second."""
    ks = 1 / 1600.0 * 0.5 ** np.arange(3)
    assert shrinks(relative_errors(series_334, ks, (1.0, -1.0)), 4)
    assert shrinks(relative_errors(lambda own, easy, h: own, ks, (1.0, -1.0)), 2)


def test_figure_3_8():
    """H_y = 1 G under H_x of up to 3 G with H_k = 8 G: equations 3.13 and 3.34 against the exact film."""
    across = np.linspace(-3, 3, 25)
    field = GAUSS * np.stack([np.ones(25), across, np.zeros(25)])
    k = np.full(3, 1 / (8 * GAUSS))
    one = apply("cross_field", field, k, state=1.0)[0] / GAUSS
    flipped = 0.5 * (one + apply("cross_field", field, k, state=-1.0)[0] / GAUSS)
    gamma = 1 / (8 + across)
    assert np.allclose(one, 8 * gamma * np.sqrt(1 - gamma**2), rtol=0.02)  # 3.13 takes the angle for its sine
    assert np.allclose(flipped, [series_334(1, x, 8) for x in across], rtol=0.02)
    assert 1.5 < one[0] < 1.65  # the blue curve spans this at the edges
    assert 0.7 < one[-1] < 0.75
    assert np.max(np.abs(flipped - 1)) < 0.17  # the red one stays within, and is even
    assert np.allclose(flipped, flipped[::-1], rtol=1e-12)


def test_flipping_removes_the_bridge_offset_and_its_drift():
    """Eqs. 3.37-3.43: the mean of SET and of the turned RESET is free of the bridge's offset."""
    model = compose(("scale", "bias", "bias_temperature"), Setup(flipping="raw", lsb_per_ut=3.0))
    p = np.array([3.0, 3.0, 3.0, 5.0, 6.0, 7.0, 40.0, -30.0, 20.0, 0.0, 0.0, 0.0])
    field = np.random.default_rng(0).uniform(-50, 50, (3, 8))
    after_set, after_reset = (
        model.predict(field, p, Conditions(state=s, temp_c=np.full(8, 25.0), raw_polarity=True)) for s in (1.0, -1.0)
    )
    assert np.allclose(0.5 * (after_set + after_reset), 3 * field + np.array([[5.0], [6.0], [7.0]]))
    raw_sum = 0.5 * (after_set - after_reset)  # RESET with its own sign again
    assert np.allclose(raw_sum, np.array([[40.0], [-30.0], [20.0]]))


def power_up(ambient, bias, k=(1e-3, 1.2e-3, 0.9e-3)):
    """SET and RESET readings (turned to one sign) while 50 known coil fields act, with today's gains."""
    model = compose(("cross_field", "scale", "bias"), Setup(flipping="raw", lsb_per_ut=3.0))
    p = np.concatenate([k, [3.0, 3.1, 2.9], bias, [40.0, -30.0, 20.0]])
    coil = 60.0 * np.random.default_rng(0).normal(size=(3, 50))
    at = Conditions(coil_ut=coil, gain=(1.02, 0.97, 1.01), raw_polarity=True)
    field = np.tile(np.reshape(ambient, (3, 1)), 50)
    return [model.predict(field, p, replace(at, state=s)) for s in (1.0, -1.0)], coil


@pytest.mark.parametrize("ambient", [(0.0, 0.0, 0.0), (20.0, -15.0, 40.0)])
def test_a_power_up_knows_gains_and_bridge_offset_in_any_field(ambient):
    """Differences between coil currents give the gain, the sum of raw SET and RESET the bridge's offset (k = 0)."""
    (after_set, after_reset), coil = power_up(ambient, (5.0, 6.0, 7.0), k=(0.0, 0.0, 0.0))
    for axis, gain in enumerate((3.0 * 1.02, 3.1 * 0.97, 2.9 * 1.01)):
        assert np.polyfit(coil[axis], 0.5 * (after_set + after_reset)[axis], 1)[0] == pytest.approx(gain, rel=1e-12)
    assert np.allclose(0.5 * (after_set - after_reset), [[40.0], [-30.0], [20.0]])


def test_a_power_up_cannot_tell_bias_from_ambient_field():
    """On an axis that lies along no other die's easy axis, a field is a bias to every reading."""
    linear = (1e-3, 1.2e-3, 0.0)  # and while its own law is straight
    here, _ = power_up((0.0, 0.0, 10.0), (5.0, 6.0, 7.0), linear)
    there, _ = power_up((0.0, 0.0, 0.0), (5.0, 6.0, 7.0 + 10.0 * 2.9 * 1.01), linear)
    assert 2 not in Conditions().easy_axis
    assert np.allclose(here, there, rtol=1e-13)


def test_linear_part_is_the_thesis_matrix():
    """A = S_f S_m S_si (4.6): the same matrix by the three effects, rows of S_m brought to unit length."""
    model = compose(("soft_iron", "misalignment", "scale"), Setup(reference="constant"))
    soft, angles, gains = np.array([0.02, -0.03, 0.05]), np.array([0.01, -0.02, 0.03]), np.array([2.0, 3.0, 4.0])
    s_si = np.array([[1, 0.02, -0.03], [0.02, 1, 0.05], [-0.03, 0.05, 1]])
    s_m = np.array([[1, 0.01, -0.02], [0, 1, 0.03], [0, 0, 1]])
    s_m = s_m / np.linalg.norm(s_m, axis=1)[:, None]
    p = np.concatenate([soft, angles, gains])
    assert np.allclose(model.predict(np.eye(3), p, Conditions()), np.diag(gains) @ s_m @ s_si, rtol=1e-14)
    assert np.allclose(np.linalg.norm(np.diag(gains) @ s_m, axis=1), gains)  # the article's sensitivity, 2.2.1


def test_saturation_is_a_tangent_and_begins_as_a_cubic():
    level, x = 100.0, np.linspace(-100, 100, 41)
    out = apply("saturation", [x, x, x], np.full(3, level**-2))[0]
    m = level * np.sqrt(2 / 3)  # tanh of this level has the same cubic term
    assert np.max(np.abs(out - m * np.tanh(x / m))) < 0.021 * level
    errors = []
    for small in 25.0 * 0.5 ** np.arange(4):
        cubic = apply("cubic", [[small]] * 3, np.full(3, -0.5 * level**-2))[0, 0]
        errors.append(abs(apply("saturation", [[small]] * 3, np.full(3, level**-2))[0, 0] / cubic - 1))
    assert shrinks(errors, 4)
    assert np.max(np.abs(apply("saturation", [[1e9]] * 3, np.full(3, level**-2)))) <= level


@pytest.mark.parametrize(("name", "powers"), [("quadratic", 2), ("cubic", 3)])
def test_polynomials_are_undone_to_their_roots(name: str, powers: int):
    effect = find_effect(name)
    for bound in ("lower", "upper"):
        p = [0.98 * getattr(q, bound) for q in effect.params(Setup(span_ut=50.0))]
        x = np.linspace(-40, 40, 23)  # the largest field seen is 50 / 1.5
        y = x + p[0] * x**powers
        found = np.asarray(effect.undo((y, y, y), p, Conditions()))[0]
        assert np.max(np.abs(found - x)) < 1e-11
        for value, x in zip(y, found, strict=True):
            roots = np.roots([p[0]] + [0.0] * (powers - 2) + [1.0, -value])
            assert np.min(np.abs(roots - x)) < 1e-11


def test_lag_is_a_resistor_and_a_capacitor():
    """A sine comes out smaller and later as 1 / (1 + i w tau), the better the finer the steps."""
    tau, omega, errors = 0.02, 2 * np.pi * 3.0, []
    expected = 1 / (1 + 1j * omega * tau)
    for dt in 0.004 * 0.5 ** np.arange(4):
        t = np.arange(0, 3, dt)
        out = apply("lag", [np.sin(omega * t)] * 3, [tau] * 3, t_s=t)[0]
        last = t >= 2.0
        wave = np.linalg.lstsq(np.stack([np.sin(omega * t), np.cos(omega * t)], 1)[last], out[last], rcond=None)[0]
        errors.append(abs(complex(wave[0], wave[1]) - expected))
    assert shrinks(errors, 1)


def test_lag_decays_after_a_step_over_any_timestamps():
    rng = np.random.default_rng(0)
    t = np.sort(rng.uniform(0, 1, 20000))
    out = apply("lag", [np.where(t > 0.2, 1.0, 0.0)] * 3, [0.1] * 3, t_s=t)[0]
    assert np.max(np.abs(out - np.where(t > 0.2, 1 - np.exp(-(t - 0.2) / 0.1), 0.0))) < 1e-3


def test_lag_of_a_buffered_logger_spreads_its_bursts():
    """A logger that stamps ten samples at a time loses the times, not their order."""
    t = np.arange(1, 401) * 0.01
    stamped = np.repeat(t[9::10], 10)
    field = [np.sin(7 * t)] * 3
    there, here = (apply("lag", field, [0.05] * 3, t_s=one) for one in (stamped, t))
    assert np.allclose(there, here, rtol=1e-12)


def test_lag_without_any_time_step_is_none():
    field = np.random.default_rng(0).normal(size=(3, 9))
    assert np.array_equal(apply("lag", field, [0.05] * 3, t_s=np.full(9, 3.0)), field)


def test_hysteresis_is_a_play_and_its_loop_has_the_height():
    rng = np.random.default_rng(0)
    x, width = np.cumsum(rng.normal(size=500)), 3.0
    z = x.copy()
    for k in range(1, x.size):
        z[k] = min(max(z[k - 1], x[k] - width), x[k] + width)
    assert np.array_equal(play(x, width), z)
    up_down = np.concatenate([np.linspace(0, 40, 101), np.linspace(40, -40, 201), np.linspace(-40, 40, 201)])
    out = apply("hysteresis", [up_down] * 3, [0.1, 0.1, 0.1, 5.0])[0]
    falling, rising = out[101:302][np.abs(up_down[101:302]) < 20], out[302:][np.abs(up_down[302:]) < 20]
    assert falling[::-1] - rising == pytest.approx(np.full(falling.size, 2 * 0.1 * 5.0))


def test_coil_heat_follows_the_law_of_cooling():
    """Switched on for a time, the die warms as 1 - exp(-t/tau) and cools as exp(-t/tau)."""
    dt, tau, current = 0.001, 1.5, 4.0
    t = np.arange(0, 10, dt)
    i = np.zeros((3, t.size))
    i[0] = np.where((t > 1.0) & (t < 5.0), current, 0.0)
    out = apply("coil_heating", np.zeros((3, t.size)), [2.0, 2.0, 2.0, 0.0, 0.0, 0.0, 0.25, tau], t_s=t, i_ma=i)
    warming = np.where(t < 1, 0.0, 1 - np.exp(-(np.minimum(t, 5) - 1) / tau))
    warm = 2.0 * current**2 * warming * np.exp(-np.maximum(t - 5, 0) / tau)
    assert np.max(np.abs(out[0] - warm)) < 1.5 * dt / tau * np.max(warm)  # the steps of time are that coarse
    assert np.allclose(out[1], 0.25 * out[0])


def test_mains_folds_below_half_the_sampling_rate():
    """50 Hz sampled 40 times a second cannot be told from 10 Hz."""
    t = np.arange(400) / 40.0
    fifty, ten = (apply("mains", np.zeros((3, 400)), [1.0, 0, 0, 0, 1.0, 0, f], t_s=t) for f in (50.0, 10.0))
    assert np.allclose(fifty, ten, atol=1e-10)


def test_mains_and_ripple_are_found_in_a_residual():
    rng = np.random.default_rng(0)
    t = np.arange(3000) / 75.0
    at = Conditions(t_s=t)
    mains, adc = find_effect("mains"), find_effect("adc_inl")
    setup = Setup(duration_s=40.0, interval_s=1 / 75, lsb_per_ut=3.0)
    left = rng.normal(size=(3, 3000))
    left[1] += 0.4 * np.sin(2 * np.pi * 25.013 * t + 1)
    (shape,) = mains.search(setup, at, left, left)
    assert shape.inner["frequency"] == pytest.approx(25.013, abs=0.002)  # a tenth of one over the length
    reading = np.cumsum(rng.normal(size=(3, 3000)), axis=1) * 5
    left = rng.normal(size=(3, 3000)) + 0.3 * np.sin(2 * np.pi * reading / 16.0)
    assert [s.inner["period"] for s in adc.search(setup, at, reading, left)] == [16.0, 16.0]


def test_inl_turns_over_with_the_raw_sign():
    """Kink and bow of a converter are even: they cancel between SET and RESET, and stay in a single state."""
    p = np.array([1e-3] * 3 + [1e-4] * 3 + [0.0] * 3)
    y = np.random.default_rng(0).uniform(-300, 300, (3, 20))
    up, down = (apply("adc_inl", y, p, state=s, raw_polarity=True) - y for s in (1.0, -1.0))
    assert np.allclose(up, 1e-3 * np.abs(y) + 1e-4 * y * y)
    assert np.allclose(down, -up)
