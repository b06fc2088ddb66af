"""Power of the flip circuit and the choice of the flip rate (thesis 3.4.3).

    P(f) = C V^2 f        the capacitor in series with the straps, charged once a cycle through a half bridge        (1)
    P(f) = 4 C V^2 f      through a full bridge, which swings it from -V to +V                                       (2)

The thesis prints (1); its circuit (fig. 3.14) is a full bridge, and the power measured (fig. 3.15) is above (1).
A time `dead_us` after each edge is not read (pulse and settling), so the fraction 1 - 2 f t of the time carries the
reading and its white noise rises by one over its root. With what is left of the flicker noise (`chopper`, eq. 2), the
density squared is (1 + c / f) / (1 - 2 f t), c = 7 zeta(3) / pi^2 f_c, and is smallest at

    f = sqrt(c^2 + c / (2 t)) - c                                                                                    (3)
"""

import math
from dataclasses import dataclass

from barberpole.design.chopper import FLICKER_LEFT
from barberpole.errors import InputError, LimitError, must

HALF_BRIDGE, FULL_BRIDGE = 1, 4  # of C V^2 f


@dataclass(frozen=True)
class FlipCircuit:
    """What drives the straps. The last three are the other losses, zero unless they are known.

    gate_nc     nC. Charge of all gates that one cycle moves
    gate_v      V. Supply of the gate drivers
    standing_mw mW. What is drawn without flipping: charge pump, drivers
    """

    capacitor_nf: float
    supply_v: float
    bridge: int = HALF_BRIDGE
    gate_nc: float = 0.0
    gate_v: float = 0.0
    standing_mw: float = 0.0


@dataclass(frozen=True)
class RateChoice:
    """A flip rate and why.

    lowest_hz, highest_hz, quietest_hz   bounds by bandwidth and power, and the rate of the least noise
    noise_factor                         density over that of the white noise read without pause
    decided_by                           "noise", "bandwidth" or "power"
    """

    rate_hz: float
    lowest_hz: float
    highest_hz: float
    quietest_hz: float
    power_mw: float
    noise_factor: float
    decided_by: str


def capacitor_power_mw(circuit: FlipCircuit, rate_hz: float) -> float:
    """Power of charging the capacitor in mW, eq. (1) or (2)."""
    return circuit.bridge * circuit.capacitor_nf * 1e-6 * circuit.supply_v**2 * rate_hz


def other_losses_mw(circuit: FlipCircuit, rate_hz: float) -> float:
    """Power of the gates and of what is drawn without flipping, mW."""
    return circuit.gate_nc * 1e-6 * circuit.gate_v * rate_hz + circuit.standing_mw


def flip_power_mw(circuit: FlipCircuit, rate_hz: float) -> float:
    """All of it, mW."""
    return capacitor_power_mw(circuit, rate_hz) + other_losses_mw(circuit, rate_hz)


def read_fraction(rate_hz: float, dead_us: float) -> float:
    """Part of the time that carries the reading; zero or less where the pauses fill the cycle."""
    return 1.0 - 2e-6 * rate_hz * dead_us


def noise_factor(rate_hz: float, corner_hz: float, dead_us: float) -> float:
    """Density over that of the white noise read without pause. Raises LimitError where nothing is left to read."""
    fraction = read_fraction(rate_hz, dead_us)
    if fraction <= 0:
        at_most = f"below {0.5e6 / dead_us:.4g} Hz (twice {dead_us:g} µs in each cycle)"
        raise LimitError(must("the flip rate", at_most, f"{rate_hz:g} Hz"))
    return math.sqrt((1.0 + FLICKER_LEFT * corner_hz / rate_hz) / fraction)


def quietest_rate_hz(corner_hz: float, dead_us: float) -> float:
    """Rate of the least noise, eq. (3)."""
    c = FLICKER_LEFT * corner_hz
    return math.sqrt(c * c + c / (2e-6 * dead_us)) - c


def highest_rate_hz(circuit: FlipCircuit, budget_mw: float) -> float:
    """Rate that takes the whole power budget. Raises LimitError where the standing loss takes it already."""
    left_mw = budget_mw - circuit.standing_mw
    if left_mw <= 0:
        at_least = f"above the {circuit.standing_mw:g} mW drawn without flipping"
        raise LimitError(must("the power budget", at_least, f"{budget_mw:g} mW"))
    return left_mw / (flip_power_mw(circuit, 1.0) - circuit.standing_mw)


def choose_rate(
    circuit: FlipCircuit, corner_hz: float, dead_us: float, bandwidth_hz: float, budget_mw: float
) -> RateChoice:
    """The quietest rate that passes the bandwidth (two cycles a period at least) within the budget.

    Raises InputError for values that are not positive, LimitError where bandwidth and budget exclude each other.
    """
    for name, value in (("corner_hz", corner_hz), ("dead_us", dead_us), ("bandwidth_hz", bandwidth_hz)):
        if not value > 0:
            raise InputError(must(name, "positive", value))
    lowest, highest, quietest = (
        2.0 * bandwidth_hz,
        highest_rate_hz(circuit, budget_mw),
        quietest_rate_hz(corner_hz, dead_us),
    )
    if lowest > highest:
        got = f"{bandwidth_hz:g} Hz, which needs {flip_power_mw(circuit, lowest):.3g} mW"
        raise LimitError(must("the bandwidth", f"at most {0.5 * highest:.4g} Hz within {budget_mw:g} mW", got))
    rate = min(max(quietest, lowest), highest)
    decided_by = "noise" if rate == quietest else "bandwidth" if rate == lowest else "power"
    factor = noise_factor(rate, corner_hz, dead_us)
    return RateChoice(rate, lowest, highest, quietest, flip_power_mw(circuit, rate), factor, decided_by)
