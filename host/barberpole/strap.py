"""The current of a flip pulse: a half bridge drives the three straps in series through one capacitor (thesis 3.4.3)."""

import math

from barberpole.board_tables import Board


def strap_power_mw(board: Board) -> float:
    """Power of flipping in mW: C V² f (thesis 3.4.3)."""
    flip = board.flip
    return flip.capacitor_nf * 1e-9 * flip.strap_supply_v**2 * flip.rate_hz * 1e3


def strap_ohm(board: Board) -> float:
    """The three straps of every sensor in series, with the driver."""
    return 3.0 * board.in_series * board.sensor.strap_ohm + board.flip.driver_ohm


def strap_decay(board: Board) -> float:
    """exp(-t / RC) at the end of a pulse: what is left of its current."""
    return math.exp(-board.flip.pulse_us / (strap_ohm(board) * board.flip.capacitor_nf * 1e-3))


def strap_peak_a(board: Board) -> float:
    """Peak of the pulse in A. Pulses to and fro find the capacitor charged to V d / (1 + d), so V / R / (1 + d) flows.

    d = exp(-t / RC) is what a pulse leaves. A capacitor that a pulse does not charge through weakens the next one.
    """
    return board.flip.strap_supply_v / strap_ohm(board) / (1.0 + strap_decay(board))


def strap_mean_a(board: Board) -> float:
    """Mean current over the pulse in A: peak × RC / t × (1 - d)."""
    share = strap_ohm(board) * board.flip.capacitor_nf * 1e-3 / board.flip.pulse_us
    return strap_peak_a(board) * share * (1.0 - strap_decay(board))
