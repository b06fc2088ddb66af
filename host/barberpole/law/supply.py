"""Bridge on a constant voltage or a constant current over temperature (thesis 3.15-3.26, 3.37-3.43).

Four resistors, R1 and R2 in one leg, R3 and R4 in the other, all of them with the temperature coefficient alpha:
R(theta) = R (1 + alpha d_theta), where d_theta is the temperature above that of R. Resistances in ohm, temperature in
K, alpha in 1/K, voltages in V, currents in A.
"""

from dataclasses import dataclass

import numpy as np

Array = np.ndarray | float


@dataclass(frozen=True)
class Bridge:
    """Resistances in ohm without field, and their temperature coefficient in 1/K."""

    r1_ohm: float
    r2_ohm: float
    r3_ohm: float
    r4_ohm: float
    alpha_per_k: float

    @property
    def equivalent_ohm(self) -> float:
        """What the supply sees, eq. 3.18."""
        left, right = self.r1_ohm + self.r2_ohm, self.r3_ohm + self.r4_ohm
        return left * right / (left + right)

    @property
    def transfer_ohm(self) -> float:
        """Output over current, R_total of eq. 3.23."""
        left, right = self.r1_ohm + self.r2_ohm, self.r3_ohm + self.r4_ohm
        return (self.r2_ohm * right - self.r4_ohm * left) / (left + right)


def offset_on_voltage_v(bridge: Bridge, supply_v: float, warmer_k: Array = 0.0) -> Array:
    """Offset in V on a constant voltage, eq. 3.16: the same at any temperature (3.17)."""
    heat = 1.0 + bridge.alpha_per_k * np.asarray(warmer_k)
    r1, r2, r3, r4 = (r * heat for r in (bridge.r1_ohm, bridge.r2_ohm, bridge.r3_ohm, bridge.r4_ohm))
    return supply_v * (r2 / (r1 + r2) - r4 / (r3 + r4))


def offset_on_current_v(bridge: Bridge, supply_a: float, warmer_k: Array = 0.0) -> Array:
    """Offset in V on a constant current, eq. 3.24."""
    return supply_a * bridge.transfer_ohm * (1.0 + bridge.alpha_per_k * np.asarray(warmer_k))


def offset_drift_on_current_v_per_k(bridge: Bridge, supply_a: float) -> float:
    """Slope of 3.24 in V/K, eq. 3.25."""
    return bridge.alpha_per_k * supply_a * bridge.transfer_ohm


def sensitivity_on_voltage(bridge: Bridge, warmer_k: Array) -> Array:
    """Sensitivity over that at d_theta = 0, which goes with the current, eq. 3.19."""
    return 1.0 / (1.0 + bridge.alpha_per_k * np.asarray(warmer_k))


def sensitivity_drift_on_voltage_per_k(bridge: Bridge, warmer_k: Array) -> Array:
    """Relative slope of the sensitivity to second order in alpha, 1/K, eq. 3.22; on a current it is zero (3.26)."""
    return -bridge.alpha_per_k + 2.0 * bridge.alpha_per_k**2 * np.asarray(warmer_k)


def unbalanced(leg_ohm: float, excess_ohm: float, alpha_per_k: float) -> Bridge:
    """Four equal resistors with the excess epsilon in R2 (thesis fig. 3.7)."""
    return Bridge(leg_ohm, leg_ohm + excess_ohm, leg_ohm, leg_ohm, alpha_per_k)


def set_and_reset_v(bridge: Bridge, supply_a: float, change_ohm: Array, warmer_k: Array = 0.0) -> tuple[Array, Array]:
    """Outputs after SET and RESET in V, eq. 3.40 and 3.41; `change_ohm` is the field's dR, with no drift of its own."""
    offset = offset_on_current_v(bridge, supply_a, warmer_k)
    signal = supply_a * np.asarray(change_ohm)
    return offset - signal, offset + signal


def demodulated_v(bridge: Bridge, supply_a: float, change_ohm: Array, warmer_k: Array = 0.0) -> Array:
    """Half the difference of SET and RESET in V, eq. 3.39: no offset is left to drift (3.43)."""
    after_set, after_reset = set_and_reset_v(bridge, supply_a, change_ohm, warmer_k)
    return 0.5 * (after_set - after_reset)
