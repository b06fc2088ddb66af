"""The physical effects. STACK lists them in physical order, from the field to the reading: the only registry."""

from barberpole.effects.bias import BIAS
from barberpole.effects.bias_temperature import BIAS_TEMPERATURE
from barberpole.effects.cross_field import CROSS_FIELD
from barberpole.effects.effect import Conditions, Effect, Param, Setup
from barberpole.effects.flip_asymmetry import FLIP_ASYMMETRY
from barberpole.effects.misalignment import MISALIGNMENT
from barberpole.effects.scale import SCALE
from barberpole.effects.sensitivity_temperature import SENSITIVITY_TEMPERATURE

STACK: tuple[Effect, ...] = (
    MISALIGNMENT,
    CROSS_FIELD,
    SENSITIVITY_TEMPERATURE,
    SCALE,
    FLIP_ASYMMETRY,
    BIAS,
    BIAS_TEMPERATURE,
)
ALIASES = {"hard_iron": "bias"}  # nothing in a log separates the two: the field of a magnet, seen through the gain

__all__ = ["ALIASES", "STACK", "Conditions", "Effect", "Param", "Setup"]
