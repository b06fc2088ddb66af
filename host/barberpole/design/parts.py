"""Amplifiers of thesis table 3.3 with the figures that noise needs."""

import math
from dataclasses import dataclass

from barberpole.errors import InputError, must

ELECTRON_C = 1.602176634e-19


@dataclass(frozen=True)
class Amplifier:
    """One amplifier.

    voltage_nv      nV/sqrt(Hz). Voltage noise at 1 kHz
    current_fa      fA/sqrt(Hz). Current noise at 1 kHz
    price_usd       $ each at 1000 (thesis table 3.3)
    instrumentation whether it is a whole instrumentation amplifier and not one of three
    """

    name: str
    voltage_nv: float
    current_fa: float
    price_usd: float
    instrumentation: bool = False

    @property
    def input_nv(self) -> float:
        """nV/sqrt(Hz) between the two inputs: two amplifiers stand there, or one instrumentation amplifier."""
        return self.voltage_nv * (1.0 if self.instrumentation else math.sqrt(2.0))


def shot_fa(bias_na: float) -> float:
    """Shot noise sqrt(2 q I) of a bias current, fA/sqrt(Hz): where a data sheet gives no current noise."""
    return 1e15 * math.sqrt(2.0 * ELECTRON_C * bias_na * 1e-9)


AMPLIFIERS = (
    Amplifier("LM324", 40.0, shot_fa(20.0), 0.1),  # data sheet: 40 nV at 1 kHz; bias current 20 nA, no current noise
    Amplifier("OPA4377", 7.5, 2.0, 1.25),  # thesis 3.5
    Amplifier("AD8648", 8.0, shot_fa(1e-3), 1.3),  # data sheet: 8 nV; bias current at most 1 pA, no current noise
    # Its noise falls with the gain; typical figures at a gain of 10, not checked against a data sheet.
    Amplifier("AMP04", 45.0, 4000.0, 10.0, instrumentation=True),
)


def find_amplifier(name: str) -> Amplifier:
    """The amplifier of that name. Raises InputError with the known names."""
    for amplifier in AMPLIFIERS:
        if amplifier.name.lower() == name.lower():
            return amplifier
    raise InputError(must("the amplifier", f"one of {', '.join(a.name for a in AMPLIFIERS)}", repr(name)))
