"""Noise of sensor, amplifier, converter and flipping together, in nT/sqrt(Hz) at the sensor.

    n^2 = (bridge^2 + amplifier^2 + converter^2) / fraction read x (1 + 7 zeta(3) / pi^2  f_c / f_0)

Bridge: thermal noise of its resistance (3.44). Amplifier: both inputs' voltage noise, and their current noise in half a
bridge each (3.45). Converter: what its data sheet gives for one conversion, and the rounding to one LSB, both white up
to half the sample rate. Barkhausen noise, magnetic noise and that of supplies are not in it.
"""

import math
from dataclasses import dataclass

from barberpole.board import Board
from barberpole.design.amplifier import ROOM_K, current_nv, thermal_nv
from barberpole.design.chopper import residual_factor
from barberpole.design.parts import Amplifier
from barberpole.errors import InputError, must


@dataclass(frozen=True)
class FrontEnd:
    """Everything between the field and the number.

    sensitivity_nv_per_nt   of the bridge on its supply
    lsb_nv, sample_hz       of the converter, at its input; conversion_uv: its noise, rms of one conversion
    gain                    of the amplifier before it (1 without)
    corner_hz               below which 1/f noise exceeds the white noise
    flip_hz, fraction       flip rate and the part of the time that is read; 0 and 1 without flipping
    """

    sensitivity_nv_per_nt: float
    bridge_ohm: float
    lsb_nv: float
    sample_hz: float
    conversion_uv: float = 0.0
    amplifier: Amplifier | None = None
    gain: float = 1.0
    corner_hz: float = 0.0
    flip_hz: float = 0.0
    fraction: float = 1.0
    temp_k: float = ROOM_K


@dataclass(frozen=True)
class NoiseBudget:
    """Contributions as densities in nT/sqrt(Hz) at the sensor, read without pause; then what flipping makes of them.

    flip_factor     total over the root of the sum of squares: pauses and what is left of 1/f noise
    """

    bridge_nt: float
    amplifier_nt: float
    converter_nt: float
    flip_factor: float

    @property
    def white_nt(self) -> float:
        """Root of the sum of squares."""
        return math.hypot(self.bridge_nt, self.amplifier_nt, self.converter_nt)

    @property
    def total_nt(self) -> float:
        """Density of the demodulated reading far below the flip rate."""
        return self.white_nt * self.flip_factor


def noise_budget(front: FrontEnd) -> NoiseBudget:
    """The budget of a front end. Raises InputError where fraction is not in 0..1."""
    if not 0.0 < front.fraction <= 1.0:
        raise InputError(must("the fraction of the time that is read", "above 0, at most 1", front.fraction))
    per_nt = front.sensitivity_nv_per_nt
    return NoiseBudget(
        thermal_nv(front.bridge_ohm, front.temp_k) / per_nt,
        amplifier_nv(front.amplifier, front.bridge_ohm) / per_nt,
        converter_nv(front) / front.gain / per_nt,
        residual_factor(front.flip_hz, front.corner_hz) / math.sqrt(front.fraction) if front.flip_hz else 1.0,
    )


def amplifier_nv(amplifier: Amplifier | None, bridge_ohm: float) -> float:
    """Noise between the two inputs in nV/sqrt(Hz); the resistors that set the gain are not in it."""
    if amplifier is None:
        return 0.0
    return math.hypot(amplifier.input_nv, math.sqrt(2.0) * current_nv(amplifier.current_fa, bridge_ohm / 2.0))


def converter_nv(front: FrontEnd) -> float:
    """Noise and rounding of the converter at its own input in nV/sqrt(Hz)."""
    one_conversion = math.hypot(front.conversion_uv * 1e3, front.lsb_nv / math.sqrt(12.0))
    return one_conversion * math.sqrt(2.0 / front.sample_hz)


def board_front_end(
    board: Board, amplifier: Amplifier | None = None, gain: float = 1.0, conversion_uv: float = 0.0
) -> FrontEnd:
    """The front end of a board file, with an amplifier before its converter if one is given."""
    sensor, adc, rate = board.sensor, board.adc, board.flip.rate_hz
    return FrontEnd(
        sensitivity_nv_per_nt=sensor.sensitivity_mv_per_v_per_ut * sensor.bridge_v * 1e3,
        bridge_ohm=sensor.bridge_ohm,
        lsb_nv=1e6 / adc.lsb_per_mv,
        sample_hz=adc.sample_hz,
        conversion_uv=conversion_uv,
        amplifier=amplifier,
        gain=gain,
        corner_hz=sensor.corner_hz,
        flip_hz=rate,
        fraction=2.0 * adc.samples_per_half / adc.sample_hz * rate,
    )
