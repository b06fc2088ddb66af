"""What each converter's driver is told: registers of the chips on SPI, pins and ring of the on-chip ones.

Every constant is there for every board, so that the firmware's modules are the same text; what a part lacks is 0 or "".
"""

import math

from barberpole import wiring
from barberpole.board import Board
from barberpole.board_checks import SPANS_V
from barberpole.errors import LimitError, must

from barberpole_codegen.emit import Constant

FIRST_RATIO = 128  # oversampling ratio of code 0; each code doubles it
MODULATOR_HZ = 4096000  # of the ADS131M08 at 8.192 MHz
LAST_RATIO_CODE = 6  # the next is 16256, not a power of two
LARGEST_GAIN = 128
FRAME_BITS = 240  # status, eight channels and check sum of 24 bits
FLIP_AF = 3  # TIM8 on every STM32F4


def adc_registers(board: Board) -> list[Constant]:
    """Rate, gains and range of a converter on SPI. Raises LimitError for what it does not have."""
    adc = board.adc
    channels = (adc.channels.x, adc.channels.y, adc.channels.z)
    m08 = adc.part == "ads131m08"
    gain1, gain2 = _gain_registers(adc.pga, channels) if m08 else (0, 0)
    if m08:
        require_frame_time(adc.baud, adc.sample_hz)
    span = SPANS_V[adc.part].index(adc.vref_v) if adc.part in SPANS_V else 0
    ratio = ratio_code(adc.sample_hz) if m08 else 0
    return [
        Constant("ADC_RATIO_CODE", ratio, f"{adc.sample_hz:g} conversions a second"),
        Constant("ADC_GAIN1", gain1, "channels 0 to 3"),
        Constant("ADC_GAIN2", gain2, "channels 4 to 7"),
        Constant("ADC_RANGE", 2 - span, "input range of an ads8688"),
    ]


def timed(board: Board) -> list[Constant]:
    """Flips and samples by timers: nothing of it where the program does both."""
    flip, adc = board.flip, board.adc
    on = flip.timing == "hardware"
    channels = [wiring.flip_channel(board, pin) if on else 0 for pin in (flip.set_pin, flip.reset_pin)]
    return [
        Constant("TIMED", on, "flips and samples by hardware timers"),
        Constant("RATE_HZ", flip.rate_hz),
        Constant("DEAD_US", flip.dead_time_us),
        Constant("BREAK_PIN", flip.break_pin, "kill loop"),
        Constant("SET_CHANNEL", channels[0], "of TIM8"),
        Constant("RESET_CHANNEL", channels[1]),
        Constant("FLIP_AF", FLIP_AF, "alternate function of TIM8"),
        Constant("SCAN_HZ", adc.sample_hz if on else 0, "scans a second"),
        Constant("RING_CYCLES", adc.ring_cycles, "flip cycles that the ring of samples holds"),
        Constant("ADC_PINS", wiring.adc_pins(board) if on else (), "of the on-chip converter"),
    ]


def dac_output(board: Board) -> list[Constant]:
    """The third output of the on-chip DAC: a filtered PWM."""
    pin = board.dac.pwm_pin
    timer, channel, af = wiring.timer_output(board, pin) if pin else ("", 0, 0)
    return [
        Constant("DAC_PART", board.dac.part),
        Constant("DAC_PINS", wiring.dac_pins(board), "of the on-chip converter"),
        Constant("PWM_PIN", pin, "third output of the on-chip converter"),
        Constant("PWM_TIMER", int(timer.removeprefix("TIM") or 0)),
        Constant("PWM_CHANNEL", channel),
        Constant("PWM_AF", af),
    ]


def _gain_registers(pga: int, bridges: tuple[int, ...]) -> tuple[int, int]:
    """GAIN1 and GAIN2: four channels each, four bits a channel, the code is log2 of the gain; gain 1 elsewhere."""
    code = pga.bit_length() - 1
    if pga != 1 << code or pga > LARGEST_GAIN:
        raise LimitError(must("adc.pga", f"a power of two up to {LARGEST_GAIN}, as the ads131m08 has them", pga))
    both = sum(code << (4 * channel) for channel in bridges)
    return both & 0xFFFF, both >> 16


def ratio_code(sample_hz: float) -> int:
    """CLOCK.OSR: the power of two by which the oversampling ratio exceeds the smallest."""
    ratio = MODULATOR_HZ / FIRST_RATIO / sample_hz
    code = round(math.log2(ratio))
    if ratio != 2.0**code or not 0 <= code <= LAST_RATIO_CODE:
        rates = ", ".join(f"{MODULATOR_HZ / FIRST_RATIO / 2**k:g}" for k in range(LAST_RATIO_CODE + 1))
        raise LimitError(must("adc.sample_hz", f"a rate of the ads131m08 ({rates})", f"{sample_hz:g}"))
    return code


def require_frame_time(baud: int, sample_hz: float) -> None:
    """A frame must be read before the next conversion, or conversions are lost."""
    needed = FRAME_BITS * sample_hz
    if baud < needed:
        raise LimitError(must("adc.baud", f"at least {needed:g} bit/s ({FRAME_BITS} bits a conversion)", f"{baud}"))
