# bp_hardware.py: what is soldered, made from the board's constants: pins, buses, converters, coils, sampler.
# The only file that makes pins and buses; it hands them on.
import machine

import bp_board as board
import bp_calibration as calibration
from bp_ads131m08 import Ads131m08
from bp_coils import Coils
from bp_compensate import Compensator
from bp_dac80504 import Dac80504
from bp_flip import Flip
from bp_sampler import Sampler


class Hardware:
    def __init__(self):
        set_pin = _output(board.SET_PIN, 0)
        reset_pin = _output(board.RESET_PIN, 0)
        self.flip = Flip(set_pin, reset_pin, board.PULSE_US, machine.disable_irq, machine.enable_irq)
        dac_bus = machine.SPI(board.DAC_SPI, baudrate=board.DAC_BAUD, polarity=0, phase=1)
        self.dac = Dac80504(dac_bus, _output(board.DAC_CS_PIN, 1))
        self.coils = Coils(self.dac, board.DAC_CHANNELS, board.FULL_SCALE_MA)
        adc_bus = machine.SPI(board.ADC_SPI, baudrate=board.ADC_BAUD, polarity=0, phase=1)
        drdy = machine.Pin(board.ADC_DRDY_PIN, machine.Pin.IN)
        self.adc = Ads131m08(adc_bus, _output(board.ADC_CS_PIN, 1), drdy, _output(board.ADC_RESET_PIN, 1))
        self.sampler = Sampler(self.adc, self.flip, board)
        self.compensator = Compensator(board, calibration)

    def off(self):
        self.flip.off()
        self.coils.zero()


def _output(name, value):
    return machine.Pin(name, machine.Pin.OUT, value=value)
