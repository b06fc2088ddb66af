# bp_reasons.py: why a self-calibration, or the whole board, was not accepted. Host and board share the codes:
# host/barberpole/reasons.py holds the same table, and a test keeps the two equal.
from micropython import const

OK = const(0)
RESIDUAL = const(1)
AMBIENT_STEP = const(2)
GAIN_DRIFT = const(3)
SATURATED = const(4)
COIL_CURRENT = const(5)
ADC_SILENT = const(6)
ADC_STUCK = const(7)
WRONG_CHIP = const(8)
STORE_CORRUPT = const(9)
NO_FACTORY_REFERENCE = const(10)
SUPPLY_LOW = const(11)
MODEL_MISMATCH = const(12)
INTERRUPTED = const(13)
SHADOWED = const(14)
OUT_OF_RANGE = const(15)
STORE_FAILED = const(16)
FLIP_STOPPED = const(17)
SAMPLES_LOST = const(18)
WATCHDOG = const(19)
FACTORY_RESET = const(20)

# name and sentence by code
TABLE = (
    ("ok", "Nothing is wrong."),
    ("residual", "The points of the coil run do not lie on a straight line: the residual exceeds what noise explains."),
    ("ambient_step", "The ambient field changed while the coils were driven."),
    ("gain_drift", "The gain of an axis is further from its factory value than this board allows."),
    ("saturated", "The converter reached the end of its range."),
    ("coil_current", "The current read back from a coil is not the current that was asked for."),
    ("adc_silent", "The converter gave no sample in time."),
    ("adc_stuck", "The converter repeats one code: no sensor noise is in its samples."),
    ("wrong_chip", "A chip on the bus does not identify itself as the part in the board file."),
    ("store_corrupt", "A stored calibration failed its check sum and is not used."),
    ("no_factory_reference", "The calibration holds no factory coil response, so today's gains cannot be compared."),
    ("supply_low", "The supply of the flip pulses is too low to switch the bridges fully."),
    ("model_mismatch", "Board constants, trajectory and calibration on this board were not built together."),
    ("interrupted", "The run was interrupted before its verdict."),
    ("shadowed", "A stray file hides a module of the same name in the firmware."),
    ("out_of_range", "A reading lies outside the range in which the model can be undone."),
    ("store_failed", "The flash did not take a file: what was in force stays in force."),
    ("flip_stopped", "The break input has stopped the flip pulses."),
    ("samples_lost", "Flip cycles went by unread: a pause was longer than the ring of samples is deep."),
    ("watchdog", "The watchdog restarted the board: its program had stood still."),
    ("factory_reset", "A host put the factory calibration in force."),
)


def name(code):
    return TABLE[code][0]


def text(code):
    return TABLE[code][1]


class Fault(Exception):  # raised with a code where the hardware cannot go on
    def __init__(self, code, detail=""):
        super().__init__(code, detail)
        self.code = code
        self.detail = detail
