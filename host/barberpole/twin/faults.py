"""What can be broken on the emulated board, by name."""

from collections.abc import Iterable

from barberpole.errors import InputError, must

FAULTS = {
    "coil_open_x": "the x coil's wire is open: no current, no field",
    "coil_open_y": "the y coil's wire is open: no current, no field",
    "coil_open_z": "the z coil's wire is open: no current, no field",
    "coil_short_x": "the x coil is shorted: the current flows past it, larger than commanded",
    "coil_short_y": "the y coil is shorted: the current flows past it, larger than commanded",
    "coil_short_z": "the z coil is shorted: the current flows past it, larger than commanded",
    "adc_stuck": "every conversion of the ADC repeats the first one",
    "adc_silent": "the ADC answers and keeps its registers, but no conversion ever comes",
    "second_adc_stuck": "every conversion of an array's second ADC repeats the first one",
    "second_adc_silent": "an array's second ADC answers and keeps its registers, but no conversion ever comes",
    "second_wrong_chip": "an array's second ADC answers with the identity of another part",
    "dac_silent": "the DAC does not answer on its bus",
    "wrong_chip": "the ADC answers with the identity of another part",
    "ambient_step": "the ambient field jumps while the coils are first driven",
    "flash_full": "the file system of the flash is filled to the last block",
    "store_corrupt": "a bit of each stored calibration has fallen over",
    "supply_low": "the strap supply is at 60 %: its pulses do not flip the bridges",
}


FLASH_FAULTS = frozenset(("flash_full", "store_corrupt"))  # played by the interpreter's own flash (shims/_start.py)


SECOND = "second_"


def check_faults(names: Iterable[str], sensors: int = 1) -> frozenset[str]:
    """The names as a set. Raises InputError on one that is not in FAULTS, or of a sensor that is not there."""
    names = tuple(names)
    for name in names:
        if name not in FAULTS:
            raise InputError(must("the fault", f"one of {', '.join(FAULTS)}", repr(name)))
        if name.startswith(SECOND) and sensors < 2:
            raise InputError(must("the fault", "one of a board with one sensor", repr(name)))
    return frozenset(names)


def of_sensor(faults: frozenset[str], index: int) -> frozenset[str]:
    """What of it a sensor of an array has: the wires, the supply and the field are looked after by the first."""
    if index == 0:
        return frozenset(name for name in faults if not name.startswith(SECOND))
    return frozenset(name.removeprefix(SECOND) for name in faults if name.startswith(SECOND))
