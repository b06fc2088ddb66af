# bp_hardware.py: what is soldered, made from the board's constants: pins, buses, converters, coils, sampler.
# The only file that makes pins and buses; it hands them on. The board file names the parts; what it does not name is
# not imported, so it takes no room.
import machine

import bp_board as board
import bp_calibration as calibration
from bp_coils import Coils
from bp_compensate import Compensator


class Hardware:
    def __init__(self):
        make = _timed if board.TIMED else _programmed
        self.flip, self.sampler, self.start, self._stop = make()  # start() raises reasons.Fault
        self.dac = _dac()
        self.coils = Coils(self.dac, board.DAC_CHANNELS, board.FULL_SCALE_MA)
        self.compensator = Compensator(board, calibration)

    def off(self):  # pulses, then samples, then coils
        self.flip.off()
        self._stop()
        self.coils.zero()


def _timed():  # flips and samples by timers, the on-chip converter
    from bp_timed import make
    from bp_timers import Pulses

    pulses = Pulses(board)
    sampler = make(pulses, board)
    return pulses, sampler, sampler.start, sampler.stop


def _programmed():  # flips and samples by the program, a converter on SPI
    from bp_flip import Flip
    from bp_sampler import Sampler

    set_pin, reset_pin = _output(board.SET_PIN, 0), _output(board.RESET_PIN, 0)
    flip = Flip(set_pin, reset_pin, board.PULSE_US, machine.disable_irq, machine.enable_irq)
    adc, start = _adc()
    return flip, Sampler(adc, flip, board), start, flip.off


def _dac():
    if board.DAC_PART == "stm32f4_dac":
        from bp_onchip_dac import OnChipDac

        return OnChipDac(board.DAC_PINS, board.PWM_PIN, board.PWM_TIMER, board.PWM_CHANNEL, board.PWM_AF)
    from bp_dac80504 import Dac80504

    bus = machine.SPI(board.DAC_SPI, baudrate=board.DAC_BAUD, polarity=0, phase=1)
    return Dac80504(bus, _output(board.DAC_CS_PIN, 1))


def _adc():
    select = _output(board.ADC_CS_PIN, 1)
    bus = machine.SPI(board.ADC_SPI, baudrate=board.ADC_BAUD, polarity=0, phase=1)
    if board.ADC_PART == "ads8688":
        from bp_ads8688 import Ads8688

        ads8688 = Ads8688(bus, select)
        return ads8688, lambda: ads8688.start(board.ADC_RANGE)
    from bp_ads131m08 import Ads131m08

    drdy = machine.Pin(board.ADC_DRDY_PIN, machine.Pin.IN)
    m08 = Ads131m08(bus, select, drdy, _output(board.ADC_RESET_PIN, 1))
    return m08, lambda: m08.start(board.ADC_RATIO_CODE, board.ADC_GAIN1, board.ADC_GAIN2)


def _output(name, value):
    return machine.Pin(name, machine.Pin.OUT, value=value)
