"""Amplifier noise: the published sums, the same circuit by nodal analysis, and the budget in nT."""

import math
from dataclasses import replace

import numpy as np
import pytest
from barberpole.board import load_board
from barberpole.design import amplifier as noise
from barberpole.design.noise_budget import FrontEnd, board_front_end, noise_budget
from barberpole.design.parts import AMPLIFIERS, Amplifier, find_amplifier
from barberpole.errors import InputError
from scipy.integrate import quad

CIRCUIT = noise.Circuit(1100.0, 220.0, 6490.0, 20e3, 30e3, 40e3, 42e3)
PART = Amplifier("loud in all ways", 7.5, 5e5, 1.0)  # a current noise that can be seen beside the voltage noise
QUIET = Amplifier("none", 0.0, 0.0, 0.0)

# Nodes of fig. 3.17: inputs p1 p2, inverting inputs a b, outputs o1 o2, subtractor n p, output, reference, divider.
NODES = ("p1", "p2", "a", "b", "o1", "o2", "n", "p", "out", "ref", "div")


class Network:
    """Nodal analysis with ideal amplifiers: Y v = i, with one more unknown (its output current) per amplifier."""

    def __init__(self, circuit):
        half, r2 = circuit.bridge_ohm / 2, circuit.r2_ohm
        self.resistors = [
            ("p1", None, half),
            ("p2", None, half),
            ("a", "b", circuit.r1_ohm),
            ("a", "o1", r2),
            ("b", "o2", r2),
            ("o2", "n", circuit.r5_ohm),
            ("o1", "p", circuit.r5_ohm),
            ("n", "out", circuit.r7_ohm),
            ("p", "ref", circuit.r7_ohm),
            ("div", None, circuit.r9_ohm),
            ("div", None, circuit.r10_ohm),
        ]
        self.amplifiers = [("p1", "a", "o1"), ("p2", "b", "o2"), ("p", "n", "out"), ("div", "ref", "ref")]
        size = len(NODES) + len(self.amplifiers)
        self.matrix = np.zeros((size, size))
        for u, v, ohm in self.resistors:
            w = self.branch(u, v)
            self.matrix += np.outer(w, w) / ohm
        for k, (plus, minus, output) in enumerate(self.amplifiers):
            self.matrix[len(NODES) + k] = self.branch(plus, minus)
            self.matrix[NODES.index(output), len(NODES) + k] = 1.0

    def branch(self, u, v):
        w = np.zeros(len(NODES) + len(self.amplifiers))
        w[NODES.index(u)] += 1.0
        if v:
            w[NODES.index(v)] -= 1.0
        return w

    def gain(self, source):
        return np.linalg.solve(self.matrix, source)[NODES.index("out")]

    def output_nv(self, part, temp_k):
        """Root of the sum over all sources, nV/sqrt(Hz)."""
        power = 0.0
        for u, v, ohm in self.resistors:
            power += (self.gain(self.branch(u, v)) * noise.thermal_nv(ohm, temp_k) / ohm) ** 2
        for k, (plus, minus, _) in enumerate(self.amplifiers):
            error = np.zeros(len(self.matrix))
            error[len(NODES) + k] = 1.0
            power += (self.gain(error) * part.voltage_nv) ** 2
            for pin in (plus, minus):
                power += (self.gain(self.branch(pin, None)) * noise.current_nv(part.current_fa, 1.0)) ** 2
        return math.sqrt(power)


@pytest.mark.parametrize("part", [PART, QUIET, find_amplifier("LM324"), find_amplifier("OPA4377")])
def test_whole_circuit_is_its_nodal_analysis(part):
    expected = Network(CIRCUIT).output_nv(part, CIRCUIT.temp_k)
    assert noise.whole(CIRCUIT, part).total == pytest.approx(expected, rel=1e-9)


def test_published_first_stage_is_half_of_what_it_must_be():
    """With the amplifiers' voltage noise alone."""
    cold = replace(CIRCUIT, temp_k=0.0)
    part = Amplifier("voltage", 7.5, 0.0, 0.0)
    assert noise.published(cold, part).input == pytest.approx(noise.whole(cold, part).input / 2)


def test_published_sums_with_equal_resistors():
    """3.55-3.59 become 3.60-3.63."""
    circuit = replace(CIRCUIT, r5_ohm=20e3, r7_ohm=20e3)
    found = noise.published(circuit, PART)
    assert found.thermal == pytest.approx(2.0 * noise.thermal_nv(20e3))
    assert found.current == pytest.approx(math.sqrt(2.0) * PART.current_fa * 1e-15 * 20e3 * 1e9)
    assert found.u3 == PART.voltage_nv
    assert found.input == pytest.approx(math.sqrt(2.0) * noise.first_stage_published_nv(circuit, PART))


def test_thermal_noise_of_a_kilo_ohm():
    assert noise.thermal_nv(1000.0, 300.0) == pytest.approx(4.07, abs=0.005)
    assert noise.resistance_of_thermal_nv(noise.thermal_nv(1234.0)) == pytest.approx(1234.0)


@pytest.mark.parametrize("poles", [1, 2, 3, 4, 5])
def test_brick_wall_factor_is_the_area_below_the_response(poles):
    at_3_db = math.sqrt(2.0 ** (1.0 / poles) - 1.0)
    area, _ = quad(lambda f: (1.0 + f * f) ** -poles, 0.0, np.inf)
    assert noise.brick_wall_factor(poles) == pytest.approx(area / at_3_db, rel=1e-9)


def test_rms_of_one_pole():
    assert noise.total_rms_nv(10.0, 1000.0) == pytest.approx(10.0 * math.sqrt(math.pi / 2 * 1000.0))


def test_amplifiers_by_name():
    assert [part.name for part in AMPLIFIERS] == ["LM324", "OPA4377", "AD8648", "AMP04"]
    assert find_amplifier("amp04").input_nv == 45.0
    assert find_amplifier("LM324").current_fa == pytest.approx(80.0, abs=0.1)
    with pytest.raises(InputError, match="the amplifier must be one of LM324, OPA4377"):
        find_amplifier("LM741")


def test_budget_of_the_board_is_near_the_sensor_file():
    """The sensor file's white density counts bridge and an amplifier of 7.5 nV/sqrt(Hz): 0.157 by its own note."""
    board = load_board("pybv11")
    instrument = Amplifier("7.5 nV", 7.5, 2.0, 0.0, instrumentation=True)
    budget = noise_budget(board_front_end(board, instrument))
    assert budget.white_nt == pytest.approx(board.sensor.noise_nt_per_rthz, rel=0.03)
    assert budget.flip_factor == pytest.approx(math.sqrt((1 + 0.8526 * 10 / 200) / 0.4), rel=1e-4)
    assert budget.total_nt == pytest.approx(budget.white_nt * budget.flip_factor)


def test_gain_pushes_the_converter_down():
    front = FrontEnd(55.0, 1100.0, lsb_nv=38000.0, sample_hz=1000.0, amplifier=find_amplifier("OPA4377"))
    plain, amplified = noise_budget(front), noise_budget(replace(front, gain=60.0))
    assert amplified.converter_nt == pytest.approx(plain.converter_nt / 60.0)
    assert amplified.amplifier_nt == plain.amplifier_nt == pytest.approx(math.sqrt(2) * 7.5 / 55.0, rel=1e-6)
    assert plain.flip_factor == 1.0


def test_rounding_is_the_noise_of_one_lsb():
    front = FrontEnd(1.0, 0.0, lsb_nv=12.0, sample_hz=2.0)
    assert noise_budget(front).converter_nt == pytest.approx(12.0 / math.sqrt(12.0))


def test_time_that_is_never_read_is_refused():
    with pytest.raises(InputError, match="the fraction of the time"):
        noise_budget(FrontEnd(55.0, 1100.0, 1.0, 1.0, fraction=0.0))
