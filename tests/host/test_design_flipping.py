"""Flipping: the chopper simulated against its sum over harmonics, power, and the choice of the rate."""

import numpy as np
import pytest
from barberpole.design import chopper, flipping
from barberpole.design.chopper import Chain
from barberpole.design.flipping import FULL_BRIDGE, FlipCircuit
from barberpole.errors import InputError, LimitError
from scipy.optimize import minimize_scalar

CHAIN = Chain(flip_hz=200.0, signal_hz=5.0, signal_nt=20.0, white_nt_per_rthz=0.1, corner_hz=100.0)
THESIS = FlipCircuit(capacitor_nf=220.0, supply_v=12.0)


@pytest.fixture(scope="module")
def stages():
    return chopper.simulate(CHAIN, seconds=80.0, cutoff_hz=30.0, seed=3)


def mean_density(values, low_hz, high_hz):
    """Root of the mean power over a band, nT/sqrt(Hz)."""
    frequency_hz, found = chopper.density(values, CHAIN.sample_hz, 0.5)
    band = (frequency_hz >= low_hz) & (frequency_hz <= high_hz)
    return np.sqrt(np.mean(found[band] ** 2))


def test_signal_returns_and_its_carrier_lies_at_the_odd_harmonics(stages):
    frequency_hz, modulated = chopper.density(stages.modulated, CHAIN.sample_hz, 0.5)
    loudest = frequency_hz[np.argmax(modulated)]
    assert abs(loudest - CHAIN.flip_hz) == pytest.approx(CHAIN.signal_hz, abs=0.5)
    noise = stages.amplified - stages.modulated
    np.testing.assert_allclose(np.abs(stages.demodulated - stages.signal), np.abs(noise), atol=1e-9)


def test_demodulated_noise_is_the_sum_over_harmonics(stages):
    """Bands of 160 bins at 80 s: the mean power is known to about 3 %."""
    for low_hz, high_hz in ((10.0, 30.0), (60.0, 100.0)):
        middle = chopper.flipped_factor((low_hz + high_hz) / 2, CHAIN.flip_hz, CHAIN.corner_hz)
        found = mean_density(stages.demodulated, low_hz, high_hz) / CHAIN.white_nt_per_rthz
        assert found == pytest.approx(middle, rel=0.06)


def test_flicker_before_demodulation(stages):
    found = mean_density(stages.amplified - stages.modulated, 1.0, 3.0) / CHAIN.white_nt_per_rthz
    assert found == pytest.approx(chopper.unflipped_factor(1.8, CHAIN.corner_hz), rel=0.15)
    assert found > 4 * chopper.residual_factor(CHAIN.flip_hz, CHAIN.corner_hz)


def test_low_pass_takes_what_lies_at_the_flip_rate(stages):
    assert mean_density(stages.filtered, 150.0, 180.0) < 0.01 * mean_density(stages.demodulated, 150.0, 180.0)


def test_closed_form_is_the_sum():
    assert chopper.flipped_factor(0.0, 200.0, 100.0) == pytest.approx(chopper.residual_factor(200.0, 100.0), rel=1e-6)
    assert chopper.flipped_factor(50.0, 200.0, 0.0) == 1.0


def test_power_is_the_energy_of_the_capacitor():
    """From a stiff supply through a resistor: charge C V at V a cycle; a full bridge moves 2 C V twice."""
    charge_c = 220e-9 * 12.0
    assert flipping.capacitor_power_mw(THESIS, 1000.0) == pytest.approx(1e3 * charge_c * 12.0 * 1000.0)
    full = FlipCircuit(220.0, 12.0, FULL_BRIDGE)
    assert flipping.capacitor_power_mw(full, 1000.0) == pytest.approx(1e3 * 2 * (2 * charge_c) * 12.0 * 1000.0)


def test_other_losses_are_a_term_of_their_own():
    circuit = FlipCircuit(220.0, 12.0, gate_nc=30.0, gate_v=12.0, standing_mw=2.0)
    assert flipping.other_losses_mw(circuit, 0.0) == 2.0
    assert flipping.other_losses_mw(circuit, 1e3) == pytest.approx(2.0 + 0.36)
    assert flipping.flip_power_mw(THESIS, 1e3) == flipping.capacitor_power_mw(THESIS, 1e3)


def test_quietest_rate_is_the_minimum():
    def noise(log_hz):
        return flipping.noise_factor(np.exp(log_hz), 10.0, 500.0)

    found = minimize_scalar(noise, bounds=(np.log(1.0), np.log(900.0)), method="bounded", options={"xatol": 1e-9})
    assert flipping.quietest_rate_hz(10.0, 500.0) == pytest.approx(np.exp(found.x), rel=1e-5)


@pytest.mark.parametrize(
    ("bandwidth_hz", "budget_mw", "decided_by"),
    [(10.0, 40.0, "noise"), (100.0, 40.0, "bandwidth"), (10.0, 2.0, "power")],
)
def test_choice_of_the_rate(bandwidth_hz, budget_mw, decided_by):
    choice = flipping.choose_rate(THESIS, 10.0, 500.0, bandwidth_hz, budget_mw)
    assert choice.decided_by == decided_by
    assert choice.lowest_hz <= choice.rate_hz <= choice.highest_hz
    assert choice.power_mw <= budget_mw * (1 + 1e-12)


def test_what_cannot_be_is_refused():
    with pytest.raises(LimitError, match=r"the bandwidth must be at most 31\.57 Hz within 2 mW"):
        flipping.choose_rate(THESIS, 10.0, 500.0, 100.0, 2.0)
    with pytest.raises(LimitError, match="the flip rate must be below 1000 Hz"):
        flipping.noise_factor(1000.0, 10.0, 500.0)
    with pytest.raises(LimitError, match="the power budget"):
        flipping.highest_rate_hz(FlipCircuit(220.0, 12.0, standing_mw=5.0), 5.0)
    with pytest.raises(InputError, match="corner_hz must be positive"):
        flipping.choose_rate(THESIS, 0.0, 500.0, 10.0, 40.0)
