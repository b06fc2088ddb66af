# bp_flip.py: the SET and RESET pulses that magnetise the bridges one way and the other (thesis 3.4).
# A pin high closes its half of the strap driver, so a pin left high would discharge the capacitor into the strap and
# then hold the supply across it: every path out of a pulse ends with the pin low. Interrupts are off for the pulse
# only (8 µs), or one late interrupt would stretch it. On the bridge's drivers, pull-downs keep both off at reset.
import time


class Flip:
    def __init__(self, set_pin, reset_pin, pulse_us, disable_irq, enable_irq):
        self._set = set_pin
        self._reset = reset_pin
        self._pulse_us = pulse_us
        self._disable_irq = disable_irq
        self._enable_irq = enable_irq
        self.off()

    def set(self):
        self._pulse(self._set)

    def reset(self):
        self._pulse(self._reset)

    def off(self):
        self._set.value(0)
        self._reset.value(0)

    def _pulse(self, pin):
        irq = self._disable_irq()
        try:
            pin.value(1)
            time.sleep_us(self._pulse_us)
        finally:
            pin.value(0)
            self._enable_irq(irq)
