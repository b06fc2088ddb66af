"""The physical effects. STACK lists them in physical order, from the field to the reading: the only registry."""

from collections.abc import Sequence

from barberpole.effects.adc_inl import ADC_INL
from barberpole.effects.bias import BIAS
from barberpole.effects.bias_temperature import BIAS_TEMPERATURE
from barberpole.effects.coil_coupling import COIL_COUPLING
from barberpole.effects.coil_heating import COIL_HEATING
from barberpole.effects.cross_field import CROSS_FIELD
from barberpole.effects.cubic import CUBIC
from barberpole.effects.drift import DRIFT
from barberpole.effects.effect import Conditions, Effect, Param, Setup, Shape
from barberpole.effects.flip_asymmetry import FLIP_ASYMMETRY
from barberpole.effects.hysteresis import HYSTERESIS
from barberpole.effects.lag import LAG
from barberpole.effects.load_current import LOAD_CURRENT
from barberpole.effects.mains import MAINS
from barberpole.effects.misalignment import MISALIGNMENT
from barberpole.effects.outliers import OUTLIERS
from barberpole.effects.quadratic import QUADRATIC
from barberpole.effects.saturation import SATURATION
from barberpole.effects.scale import SCALE
from barberpole.effects.sensitivity_temperature import SENSITIVITY_TEMPERATURE
from barberpole.effects.soft_iron import SOFT_IRON
from barberpole.errors import InputError, must

STACK: tuple[Effect, ...] = (
    SOFT_IRON,
    LOAD_CURRENT,
    MISALIGNMENT,
    COIL_COUPLING,
    MAINS,
    LAG,
    HYSTERESIS,
    CROSS_FIELD,
    QUADRATIC,
    CUBIC,
    SATURATION,
    SENSITIVITY_TEMPERATURE,
    SCALE,
    FLIP_ASYMMETRY,
    BIAS,
    BIAS_TEMPERATURE,
    DRIFT,
    COIL_HEATING,
    ADC_INL,
    OUTLIERS,
)
BY_NAME = {effect.name: effect for effect in STACK}
BRIDGE = list(BY_NAME).index(CROSS_FIELD.name)  # effects before it are on the field
ALIASES = {"hard_iron": "bias"}  # nothing in a log separates the two: the field of a magnet, seen through the gain


def find_effect(name: str, extra: Sequence[Effect] = ()) -> Effect:
    """The effect of that name or alias. Raises InputError with the known names."""
    known = BY_NAME | {e.name: e for e in extra} if extra else BY_NAME
    wanted = ALIASES.get(name, name)
    if wanted not in known:
        raise InputError(must("effect", f"one of {', '.join(known)}", repr(name)))
    return known[wanted]


def alias_notes(names: Sequence[str]) -> tuple[str, ...]:
    """A sentence for each name that is an alias."""
    return tuple(f"{name} is {ALIASES[name]}: nothing in a log separates the two" for name in names if name in ALIASES)


def listed_as(name: str, names: Sequence[str]) -> str:
    """The name by which `names` already holds this effect, by alias or not; else `name` itself."""
    wanted = ALIASES.get(name, name)
    return next((listed for listed in names if ALIASES.get(listed, listed) == wanted), name)


def in_order(extra: Sequence[Effect] = ()) -> tuple[Effect, ...]:
    """STACK with a user's effects in their place: those on the field before the bridge, those on readings last."""
    field = tuple(e for e in extra if e.stage == "field")
    reading = tuple(e for e in extra if e.stage != "field")
    return (*STACK[:BRIDGE], *field, *STACK[BRIDGE:], *reading)


__all__ = [
    "ALIASES",
    "STACK",
    "Conditions",
    "Effect",
    "Param",
    "Setup",
    "Shape",
    "alias_notes",
    "find_effect",
    "in_order",
    "listed_as",
]
