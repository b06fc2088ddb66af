"""Why a self-calibration, or a whole board, was not accepted: the codes that host and board share.

firmware/bp_reasons.py holds the same table for the board; a test keeps the two equal.
"""

from dataclasses import dataclass

from barberpole.errors import InputError, must


@dataclass(frozen=True)
class Reason:
    """One code, its name in JSON, and a sentence for people."""

    code: int
    name: str
    text: str


TABLE = tuple(
    Reason(code, name, text)
    for code, (name, text) in enumerate(
        (
            ("ok", "Nothing is wrong."),
            (
                "residual",
                "The points of the coil run do not lie on a straight line: the residual exceeds what noise explains.",
            ),
            ("ambient_step", "The ambient field changed while the coils were driven."),
            ("gain_drift", "The gain of an axis is further from its factory value than this board allows."),
            ("saturated", "The converter reached the end of its range."),
            ("coil_current", "The current read back from a coil is not the current that was asked for."),
            ("adc_silent", "The converter gave no sample in time."),
            ("adc_stuck", "The converter repeats one code: no sensor noise is in its samples."),
            ("wrong_chip", "A chip on the bus does not identify itself as the part in the board file."),
            ("store_corrupt", "A stored calibration failed its check sum and is not used."),
            (
                "no_factory_reference",
                "The calibration holds no factory coil response, so today's gains cannot be compared.",
            ),
            ("supply_low", "The supply of the flip pulses is too low to switch the bridges fully."),
            ("model_mismatch", "Board constants, trajectory and calibration on this board were not built together."),
            ("interrupted", "The run was interrupted before its verdict."),
            ("shadowed", "A stray file hides a module of the same name in the firmware."),
            ("out_of_range", "A reading lies outside the range in which the model can be undone."),
            ("store_failed", "The flash did not take a file: what was in force stays in force."),
            ("flip_stopped", "The break input has stopped the flip pulses."),
            (
                "samples_lost",
                "Flip cycles went by unread: a pause was longer than the ring of samples is deep.",
            ),
            ("watchdog", "The watchdog restarted the board: its program had stood still."),
            ("factory_reset", "A host put the factory calibration in force."),
        )
    )
)


def reason(code: int) -> Reason:
    """The reason of a code. Raises InputError for one that is not in the table."""
    if not 0 <= code < len(TABLE):
        raise InputError(must("a reason code", f"between 0 and {len(TABLE) - 1}", code))
    return TABLE[code]


def sentence(codes: list[int]) -> str:
    """What a list of codes says, in one line."""
    return " ".join(reason(code).text for code in codes) or TABLE[0].text
