"""Noise of the three-amplifier circuit behind a bridge, as published (thesis 3.44-3.66, fig. 3.17-3.19).

U1 and U2 buffer the two halves of the bridge with the gain 1 + 2 R2 / R1 (R3 = R2), U3 subtracts with R5..R8, U4
buffers the reference from the divider R9, R10. Densities in nV/sqrt(Hz), resistances in ohm, temperature in K.

`published` is the model as printed. It halves the first stage's gain and adds the outputs of U1 and U2 as if they were
independent (3.50, 3.56); but the voltage noise of U1 appears at U1 and, with the opposite sign, at U2, so it is
amplified by the whole gain. `whole` is the same circuit with each source followed to the output.
"""

import math
from dataclasses import dataclass

from barberpole.design.parts import Amplifier

BOLTZMANN = 1.380649e-23  # J/K
ROOM_K = 300.0


@dataclass(frozen=True)
class Circuit:
    """Resistors of fig. 3.17 in ohm: the bridge, R1, R2 = R3, R5 = R6, R7 = R8, R9, R10."""

    bridge_ohm: float
    r1_ohm: float
    r2_ohm: float
    r5_ohm: float
    r7_ohm: float
    r9_ohm: float
    r10_ohm: float
    temp_k: float = ROOM_K

    @property
    def first_gain(self) -> float:
        """Gain of the first stage for a difference: 1 + 2 R2 / R1."""
        return 1.0 + 2.0 * self.r2_ohm / self.r1_ohm

    @property
    def second_gain(self) -> float:
        return self.r7_ohm / self.r5_ohm


@dataclass(frozen=True)
class OutputNoise:
    """Contributions at the output in nV/sqrt(Hz), named as in table 3.2."""

    thermal: float
    input: float
    current: float
    u3: float
    buffer: float

    @property
    def total(self) -> float:
        """Eq. 3.64."""
        return math.hypot(self.thermal, self.input, self.current, self.u3, self.buffer)


def thermal_nv(resistance_ohm: float, temp_k: float = ROOM_K) -> float:
    """Thermal noise of a resistor, sqrt(4 k T R) (3.44, 3.52)."""
    return 1e9 * math.sqrt(4.0 * BOLTZMANN * temp_k * resistance_ohm)


def resistance_of_thermal_nv(density_nv: float, temp_k: float = ROOM_K) -> float:
    """Resistor in ohm whose thermal noise that is."""
    return (1e-9 * density_nv) ** 2 / (4.0 * BOLTZMANN * temp_k)


def current_nv(current_fa: float, resistance_ohm: float) -> float:
    """Voltage that a current noise makes in a resistance (3.45, 3.48, 3.53)."""
    return current_fa * 1e-6 * resistance_ohm


def parallel(a_ohm: float, b_ohm: float) -> float:
    return a_ohm * b_ohm / (a_ohm + b_ohm)


def sensor_nv(bridge_ohm: float, amplifier: Amplifier, temp_k: float = ROOM_K) -> float:
    """Noise of half a bridge at one input: thermal, and the amplifier's current in it (3.44-3.46)."""
    half = bridge_ohm / 2.0
    return math.hypot(thermal_nv(half, temp_k), current_nv(amplifier.current_fa, half))


def published(circuit: Circuit, amplifier: Amplifier) -> OutputNoise:
    """Eq. 3.44-3.64 as printed, with one kind of amplifier throughout."""
    second, r7 = circuit.second_gain, circuit.r7_ohm
    current = math.sqrt(2.0) * current_nv(amplifier.current_fa, r7)  # 3.57
    u3 = amplifier.voltage_nv * (1.0 + second) * circuit.r5_ohm / (circuit.r5_ohm + r7)  # 3.58
    out1 = first_stage_published_nv(circuit, amplifier)
    return OutputNoise(
        thermal=_subtractor_thermal_nv(circuit),
        input=math.sqrt(2.0) * out1 * second,  # 3.56: both ways from U1 and U2 have this gain
        current=current,
        u3=u3,
        buffer=reference_nv(circuit, amplifier),  # 3.59: the ways through R8 and R7 cancel to a gain of one
    )


def first_stage_published_nv(circuit: Circuit, amplifier: Amplifier) -> float:
    """Noise at the output of U1 or U2, eq. 3.47-3.50."""
    r1, r2, t = circuit.r1_ohm, circuit.r2_ohm, circuit.temp_k
    current = current_nv(amplifier.current_fa, parallel(r2, r1 + r2)) * r2 / r1  # 3.47, 3.48
    resistors = math.hypot(thermal_nv(r2, t), thermal_nv(r1 + r2, t) * r2 / r1)  # 3.49
    sensor = sensor_nv(circuit.bridge_ohm, amplifier, t)
    return math.hypot(current, resistors, math.hypot(amplifier.voltage_nv, sensor) * circuit.first_gain / 2.0)


def reference_nv(circuit: Circuit, amplifier: Amplifier) -> float:
    """Noise at the output of the reference buffer, eq. 3.51-3.54."""
    divider = parallel(circuit.r9_ohm, circuit.r10_ohm)
    current = current_nv(amplifier.current_fa, divider)
    return math.hypot(thermal_nv(divider, circuit.temp_k), current, amplifier.voltage_nv)


def whole(circuit: Circuit, amplifier: Amplifier) -> OutputNoise:
    """The same circuit with each source followed to the output; a nodal analysis agrees."""
    second = circuit.second_gain
    return OutputNoise(
        thermal=_subtractor_thermal_nv(circuit),
        input=second * first_stage_nv(circuit, amplifier),
        current=math.sqrt(2.0) * current_nv(amplifier.current_fa, circuit.r7_ohm),
        u3=amplifier.voltage_nv * (1.0 + second),
        buffer=reference_nv(circuit, amplifier),
    )


def first_stage_nv(circuit: Circuit, amplifier: Amplifier) -> float:
    """Noise of the difference between the outputs of U1 and U2."""
    t, root_2 = circuit.temp_k, math.sqrt(2.0)
    sensor = sensor_nv(circuit.bridge_ohm, amplifier, t)
    inputs = root_2 * circuit.first_gain * math.hypot(amplifier.voltage_nv, sensor)
    currents = root_2 * current_nv(amplifier.current_fa, circuit.r2_ohm)
    feedback = root_2 * thermal_nv(circuit.r2_ohm, t)
    return math.hypot(inputs, currents, feedback, (circuit.first_gain - 1.0) * thermal_nv(circuit.r1_ohm, t))


def brick_wall_factor(poles: int) -> float:
    """Noise bandwidth over the -3 dB frequency of equal real poles, K_n of eq. 3.66 and table 3.1."""
    area = math.sqrt(math.pi) * math.gamma(poles - 0.5) / (2.0 * math.gamma(poles))
    return area / math.sqrt(2.0 ** (1.0 / poles) - 1.0)


def total_rms_nv(density_nv: float, cutoff_hz: float, poles: int = 1) -> float:
    """Noise in nV rms behind a filter of that many equal poles, eq. 3.65 and 3.66."""
    return density_nv * math.sqrt(brick_wall_factor(poles) * cutoff_hz)


def _subtractor_thermal_nv(circuit: Circuit) -> float:
    """Thermal noise of R5 to R8 at the output, eq. 3.55 with R6 = R5 and R8 = R7."""
    second, t = circuit.second_gain, circuit.temp_k
    return math.sqrt(2.0) * math.hypot(second * thermal_nv(circuit.r5_ohm, t), thermal_nv(circuit.r7_ohm, t))
