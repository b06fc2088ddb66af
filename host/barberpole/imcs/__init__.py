"""The indoor calibration system (thesis 6.1): a coil driver's record joined with a sensor's log."""

from barberpole.imcs.driven import Driven, read_driven
from barberpole.imcs.join import Joined, join

__all__ = ["Driven", "Joined", "join", "read_driven"]
