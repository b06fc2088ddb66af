# stm.py: register access. Writes are kept and nothing is behind them: this board flips and samples without timers.
from machine import mem8, mem16, mem32

__all__ = ("mem8", "mem16", "mem32")
