# bp_onchip_dac.py: three 12-bit voltages from the microcontroller: its two DAC outputs (PA4, PA5) and a timer's PWM,
# which a filter on the board turns into the third. Written through registers, so write() allocates nothing.
# Registers: RM0090 chapter 14. All three are set to half scale, which is no coil current, before an output is enabled.
import machine
import pyb
import stm
from micropython import const
from stm import mem32

_DAC_CLOCK = const(1 << 29)  # RCC_APB1ENR
_ENABLE = const(1 << 16 | 1)  # DAC_CR: EN2, EN1; buffers on, no trigger
_TOP = const(4095)
_TIMERS = {1: "TIM1", 3: "TIM3", 4: "TIM4"}


class OnChipDac:
    def __init__(self, pins, pwm_pin, timer, channel, alternate):
        self.zero = 2048
        mem32[stm.RCC + stm.RCC_APB1ENR] |= _DAC_CLOCK
        for output in (0, 1):
            self.write(output, self.zero)
        for name in pins:
            machine.Pin(name, machine.Pin.ANALOG)
        mem32[stm.DAC + stm.DAC_CR] = _ENABLE
        self._timer = pyb.Timer(timer, prescaler=0, period=_TOP)
        self._timer.channel(channel, pyb.Timer.PWM, pulse_width=self.zero)
        self._compare = getattr(stm, _TIMERS[timer]) + stm.TIM_CCR1 + 4 * (channel - 1)
        machine.Pin(pwm_pin, machine.Pin.ALT, alt=alternate)

    def start(self, gain):  # nothing to identify, no gain to check
        pass

    def write(self, channel, code):  # 0 to 4095
        if channel == 0:
            mem32[stm.DAC + stm.DAC_DHR12R1] = code
        elif channel == 1:
            mem32[stm.DAC + stm.DAC_DHR12R2] = code
        else:
            mem32[self._compare] = code
