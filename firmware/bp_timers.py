# bp_timers.py: the flip pulses and the beat of the samples from two hardware timers, no Python (STM32F405, 407, 446).
#
# TIM8 counts up and down (centre-aligned). One channel is active around CNT = 0: the SET pulse; one around CNT = ARR:
# the RESET pulse, half a cycle later. With the compare value c both last 2 c ticks and are ARR - 2 c ticks apart,
# whatever the rate is: they never overlap. Each turning point is an update, goes out as TRGO and sets TIM2 to zero;
# TIM2 beats n times in each half cycle, and each beat (its CC2) starts a scan of the converter (bp_scan). So the number
# of a scan since the start is its phase in the flip cycle.
#
# Off means low, always: the outputs' idle level is low (OIS clear), it is driven (OSSI), and the pins are handed to the
# timer last and taken back first. The break input, where the board has one, is a loop to ground: opened, it stops the
# pulses in hardware until this code starts them again. The driver needs pull-downs for the time before this code runs.
# Register names and bits are RM0090's (chapters 17 and 18; RM0390 for the F446, which has the same timers).
import time

import machine
import pyb
import stm
from micropython import const
from stm import mem32

_CEN = const(1)  # CR1
_ARPE = const(0x80)
_CENTRE = const(0x20)  # CR1.CMS = 01; the count direction of compare flags does not matter here
_TRGO_ON_UPDATE = const(2 << 4)  # CR2.MMS; all OIS bits clear
_RESET_ON_TIM8 = const(1 << 4 | 4)  # SMCR.TS = ITR1, which is TIM8; SMS = reset mode
_UG = const(1)  # EGR
_BIF = const(0x80)  # SR: the break input has acted
_MOE = const(0x8000)  # BDTR: outputs on
_BREAK = const(0x3000)  # BDTR.BKE and BKP: active high
_OFF_STATES = const(0xC00)  # BDTR.OSSI and OSSR: an output that is off is driven low, not left floating
_PWM = const(6 << 4 | 8)  # CCMR, one channel: active below the compare value; preloaded
_PWM_INVERTED = const(7 << 4 | 8)
_TICK_HZ = (12000000, 6000000, 2000000, 1000000)  # the finest whose half cycle fits the counter
_MOST = const(65535)


class Plan:  # one flip rate in ticks; raises ValueError for what the timers cannot do
    def __init__(self, rate_hz, pulse_us, dead_us, scans_per_half, tim8_hz, tim2_hz):
        self.prescaler, self.top = _half_cycle(rate_hz, tim8_hz)
        tick_hz = tim8_hz // self.prescaler
        self.compare = max(round(pulse_us * tick_hz / 2000000), 1)  # half a pulse
        if (self.top - 2 * self.compare) * 1000000 < dead_us * tick_hz:
            raise ValueError(f"SET and RESET pulses of {pulse_us:g} us are too close at {rate_hz:g} Hz")
        half_ticks = self.top * self.prescaler * (tim2_hz // 1000) // (tim8_hz // 1000)  # of TIM2
        self.scans = scans_per_half
        self.beat = half_ticks // scans_per_half
        if self.beat < 4 * scans_per_half:  # what does not divide is left at the end, and must stay below half a beat
            raise ValueError(f"{scans_per_half} scans are too many for half a cycle of {rate_hz:g} Hz")
        self.beat_us = self.beat * 1000000 // tim2_hz
        cycle_ticks = 2 * self.top * self.prescaler
        mhz = tim8_hz // 1000000
        self.cycle_us = cycle_ticks // mhz
        self.rest = cycle_ticks % mhz  # of a microsecond, over `mhz`
        self.mhz = mhz


def _half_cycle(rate_hz, tim8_hz):
    for tick_hz in _TICK_HZ:
        prescaler = tim8_hz // tick_hz
        top = round(tim8_hz / (2 * prescaler * rate_hz))
        if top <= _MOST:
            return prescaler, top
    raise ValueError(f"the flip rate must be at least 8 Hz; got {rate_hz:g}")


def plan_for(board, rate_hz):
    tim8, tim2 = pyb.Timer(8), pyb.Timer(2)
    scans = round(board.SCAN_HZ / (2 * rate_hz))
    return Plan(rate_hz, board.PULSE_US, board.DEAD_US, scans, tim8.source_freq(), tim2.source_freq())


class Pulses:
    def __init__(self, board):
        self._pins = (board.SET_PIN, board.RESET_PIN)
        self._channels = (board.SET_CHANNEL, board.RESET_CHANNEL)  # of TIM8
        self._alternate = board.FLIP_AF
        self._bdtr = _OFF_STATES | (_BREAK if board.BREAK_PIN else 0)
        self._timers = ()
        self._low()
        if board.BREAK_PIN:  # the pull-up opens what a broken loop leaves open
            machine.Pin(board.BREAK_PIN, machine.Pin.ALT, machine.Pin.PULL_UP, alt=board.FLIP_AF)

    def prepare(self, plan):  # both timers set up and standing, pulses off
        self.off()
        tim8 = pyb.Timer(8, prescaler=plan.prescaler - 1, period=plan.top, mode=pyb.Timer.CENTER)
        mem32[stm.TIM8 + stm.TIM_CR1] = _CENTRE | _ARPE  # stands
        mem32[stm.TIM8 + stm.TIM_BDTR] = self._bdtr  # outputs off
        mem32[stm.TIM8 + stm.TIM_CR2] = _TRGO_ON_UPDATE
        mem32[stm.TIM8 + stm.TIM_RCR] = 0  # an update at both turning points
        self._channel(self._channels[0], _PWM, plan.compare)
        self._channel(self._channels[1], _PWM_INVERTED, plan.top - plan.compare)
        mem32[stm.TIM8 + stm.TIM_CCER] = self._enabled()
        mem32[stm.TIM8 + stm.TIM_EGR] = _UG  # the preloaded values take effect
        mem32[stm.TIM8 + stm.TIM_SR] = 0
        tim2 = pyb.Timer(2, prescaler=0, period=plan.beat - 1)
        mem32[stm.TIM2 + stm.TIM_CR1] = 0
        mem32[stm.TIM2 + stm.TIM_CCMR1] = _PWM_INVERTED << 8  # CC2 rises in the middle of a beat
        mem32[stm.TIM2 + stm.TIM_CCR2] = plan.beat // 2
        mem32[stm.TIM2 + stm.TIM_CCER] = 1 << 4
        mem32[stm.TIM2 + stm.TIM_SMCR] = _RESET_ON_TIM8
        mem32[stm.TIM2 + stm.TIM_EGR] = _UG
        self._timers = (tim8, tim2)  # known to MicroPython, so that a soft reset stops them

    def start(self, plan):  # the first pulse is a RESET, half a pulse at CNT = 0 is held back; ticks at CNT = 0
        for name in self._pins:
            machine.Pin(name, machine.Pin.ALT, alt=self._alternate)  # driven low by the timer from here on
        tim8, tim2 = stm.TIM8, stm.TIM2
        state = machine.disable_irq()
        try:
            mem32[tim2 + stm.TIM_CR1] = _CEN
            mem32[tim8 + stm.TIM_EGR] = _UG  # CNT = 0, and through TRGO that of TIM2
            mem32[tim8 + stm.TIM_CR1] = _CENTRE | _ARPE | _CEN
            began_us = time.ticks_us()
            while mem32[tim8 + stm.TIM_CNT] <= plan.compare:
                pass
            mem32[tim8 + stm.TIM_BDTR] = self._bdtr | _MOE
        finally:
            machine.enable_irq(state)
        return began_us

    def stopped(self):  # whether the break input has stopped the pulses
        return mem32[stm.TIM8 + stm.TIM_SR] & _BIF != 0

    def off(self):  # outputs off, pins low, timers stopped; also what every error ends with
        try:
            self._silence()
        finally:  # once more: a second Ctrl-C may have cut it short
            self._silence()
            for timer in self._timers:
                timer.deinit()
            self._timers = ()

    def _silence(self):
        if self._timers:
            mem32[stm.TIM8 + stm.TIM_BDTR] = self._bdtr
        self._low()

    def _low(self):
        for name in self._pins:
            machine.Pin(name, machine.Pin.OUT, value=0)

    def _channel(self, number, mode, compare):  # number: 1 to 4
        at = stm.TIM8 + (stm.TIM_CCMR1 if number < 3 else stm.TIM_CCMR2)
        shift = 8 * (number - 1 & 1)
        mem32[at] = mem32[at] & ~(0xFF << shift) | mode << shift
        mem32[stm.TIM8 + stm.TIM_CCR1 + 4 * (number - 1)] = compare

    def _enabled(self):  # both outputs, none of the complementary ones
        first, second = self._channels
        return 1 << 4 * (first - 1) | 1 << 4 * (second - 1)
