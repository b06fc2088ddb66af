# bp_array.py: all that the running board of an array knows: what is soldered, and what belongs to each sensor.
import binascii
import sys

import machine

import bp_array_report as report
import bp_board as board
import bp_reasons as reasons
import bp_records as records
import bp_store
import bp_trajectory as trajectory
from bp_ads131m08 import Ads131m08
from bp_clock import Clock
from bp_coils import Coils
from bp_compensate import Compensator
from bp_console import Console
from bp_dac80504 import Dac80504
from bp_duty import STOPPED
from bp_flip import Flip
from bp_log import Log
from bp_points import Points
from bp_selfcal import Run
from bp_together import Follower, Part, Together
from bp_watchdog import Watchdog

FOLDER = "bp"


class Member:  # what belongs to one sensor
    def __init__(self, name, part):
        self.name = name
        self.part = part
        self.calibration = __import__("bp_calibration_" + name)
        self.compensator = Compensator(board, self.calibration)
        folder = FOLDER + "/" + name
        self.store = bp_store.Store(folder, self.calibration.CALIBRATION, self.calibration.FACTORY_OFFSET_LSB)
        self.put_in_force(self.store.load())
        self.notes = [reasons.STORE_CORRUPT] if self.store.corrupt else []
        self.codes = []  # what is wrong, or worth knowing, since the last self-calibration
        self.run: Run | None = None

    def put_in_force(self, held):
        self.held = held
        self.compensator.put_in_force(held)

    def new_run(self):
        self.run = Run(Points(trajectory.POINTS))


class Station:
    def __init__(self):
        self.writer = records.Writer(sys.stdout.buffer.write)
        self.console = Console()
        self.clock = Clock()
        self.watchdog = Watchdog(board.WATCHDOG_S)
        self._solder()
        boot = bp_store.next_boot(FOLDER)
        self.members = tuple([Member(name, part) for name, part in zip(board.SENSORS, self.sampler.parts)])
        hashes = [member.calibration for member in self.members]
        self.head = report.header(binascii.hexlify(machine.unique_id()).decode(), boot, hashes)
        self.log = Log(FOLDER, boot)
        self.state = STOPPED
        self.codes = []  # of the whole board
        self.said = ()  # header and verdict as frames, said again for a host that joins later
        self.rows = 0

    def _solder(self):
        set_pin, reset_pin = _output(board.SET_PIN, 0), _output(board.RESET_PIN, 0)
        self.flip = Flip(set_pin, reset_pin, board.PULSE_US, machine.disable_irq, machine.enable_irq)
        dac_bus = machine.SPI(board.DAC_SPI, baudrate=board.DAC_BAUD, polarity=0, phase=1)
        self.dac = Dac80504(dac_bus, _output(board.DAC_CS_PIN, 1))
        self.coils = Coils(self.dac, board.DAC_CHANNELS, board.FULL_SCALE_MA)
        selects = [_output(name, 1) for name in board.CS_PINS]  # all, before the bus speaks to one
        bus = machine.SPI(board.ADC_SPI, baudrate=board.ADC_BAUD, polarity=0, phase=1)
        reset = _output(board.ADC_RESET_PIN, 1)
        first = Ads131m08(bus, selects[0], machine.Pin(board.ADC_DRDY_PIN, machine.Pin.IN), reset)
        chips = [first] + [Follower(bus, select) for select in selects[1:]]
        self.sampler = Together(tuple([Part(chip, board) for chip in chips]), self.flip, reset, board)

    def pause(self):  # nothing is acquired between cycles here
        pass

    def off(self):  # pulses, then coils
        self.flip.off()
        self.coils.zero()

    def event(self, code, member=None, detail="", **values):  # said now, and in the flash at the next pause
        now_s = self.clock.now_s()
        if member is not None:
            values["sensor"] = member.name
        report.event(self.writer, now_s, code, detail, values)
        if code != reasons.NO_FACTORY_REFERENCE:  # it would come with every power-up
            self.log.add(now_s, code, detail, **values)
        codes = self.codes if member is None else member.codes
        if code not in codes:
            codes.append(code)


def _output(name, value):
    return machine.Pin(name, machine.Pin.OUT, value=value)
