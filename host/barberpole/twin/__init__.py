"""The emulated board: MicroPython on a serial port, over the exact physics of flipped AMR bridges.

Nothing here imports barberpole.effects, fit or model: the truth that the board plays must not be the model under test.
"""

from barberpole.twin.ambient import Fixed, Stations, Stepped, Tumble
from barberpole.twin.api import Twin
from barberpole.twin.faults import FAULTS
from barberpole.twin.temperature import Constant, Cycle, Plateaus
from barberpole.twin.world import HIDDEN, World

__all__ = [
    "FAULTS",
    "HIDDEN",
    "Constant",
    "Cycle",
    "Fixed",
    "Plateaus",
    "Stations",
    "Stepped",
    "Tumble",
    "Twin",
    "World",
]
