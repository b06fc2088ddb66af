"""Sequences of coil fields: what is driven through the offset coils (or a Helmholtz coil), and as which DAC codes."""

from barberpole.trajectory.replay import replay
from barberpole.trajectory.shapes import Trajectory, axes, sine, sphere, steps
from barberpole.trajectory.table import CodeTable, code_table, driver_table, for_board, for_driver

__all__ = [
    "CodeTable",
    "Trajectory",
    "axes",
    "code_table",
    "driver_table",
    "for_board",
    "for_driver",
    "replay",
    "sine",
    "sphere",
    "steps",
]
