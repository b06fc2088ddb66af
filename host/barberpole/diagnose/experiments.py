"""Which recording to make next."""

from collections.abc import Sequence

from barberpole.diagnose.patterns import Pattern

# What makes an effect visible, where a log that lacks it cannot show it.
MAKES_VISIBLE = {
    "flip_asymmetry": "record SET and RESET readings in turns, with a state column",
    "cross_field": "turn through all directions with SET and RESET readings in turns",
    "bias_temperature": "warm the sensor by 10 K and let it come back, twice",
    "sensitivity_temperature": "warm the sensor by 10 K and let it come back, twice, while turning",
    "drift": "record for longer than the temperature's cycle, so that time and temperature part",
    "lag": "step between orientations and hold each for a second, against a known field",
    "hysteresis": "sweep up and down to different turning points, holding at each",
    "misalignment": "apply known field vectors instead of a constant magnitude",
    "soft_iron": "apply known field vectors instead of a constant magnitude",
    "load_current": "switch the load on and off at several orientations",
    "coil_coupling": "step each coil's current in turn, up and down",
    "coil_heating": "hold a large coil current for a minute, then none for a minute",
    "mains": "sample at a rate that is no multiple or fraction of the mains frequency",
    "saturation": "record at a second, larger field magnitude",
    "quadratic": "record at a second field magnitude",
    "cubic": "record at a second field magnitude",
    "adc_inl": "sweep the field slowly through the whole range",
}
REST = "record the sensor at rest for 60 s and pass it with --noise"


def next_experiment(
    verdict: str, groups: Sequence[tuple[str, ...]], blind: Sequence[str], remains: Sequence[Pattern]
) -> str:
    """One sentence: settle a group that this log cannot tell apart, or make an invisible effect visible."""
    for group in groups:
        ways = dict.fromkeys(MAKES_VISIBLE[name] for name in group if name in MAKES_VISIBLE)
        return f"to tell {' from '.join(group)}: {'; '.join(ways)}"
    if remains:
        first = remains[0]
        return f"the suspects leave structure: {first.axis} against {first.against}, {first.shape}"
    if verdict == "unexplained":
        return "no effect in the catalogue explains what is left: the patterns say against what it varies"
    for name in blind:
        if name in MAKES_VISIBLE:
            return f"this log cannot show {name}: {MAKES_VISIBLE[name]}"
    return ""
