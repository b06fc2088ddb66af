# bp_main.py of the coil driver, the second board (thesis 6.1.2.1). It plays the table of codes through a Helmholtz coil
# of three axes, over and over, reads each current back through its shunt, and logs a row for each point held. What
# field that was is for the reader to say, who knows the coil constants. Ctrl-C ends it at any time: no current, back to
# the REPL.
import binascii
import struct
import sys
import time

import machine
from micropython import const

import bp_board as board
import bp_reasons as reasons
import bp_records as records
import bp_trajectory as trajectory
from bp_ads131m08 import FRAME_BYTES, Ads131m08
from bp_coils import Coils
from bp_dac80504 import Dac80504

VERSION = "0.1.0"
# A row is one point: the middle of the reading, the span in which the field stood still, the point, the currents.
COLUMNS = [["t_s", "q", 1e-6], ["from_s", "q", 1e-6], ["to_s", "q", 1e-6], ["point", "H", 1.0]] + [
    [name, "f", 1.0] for name in ("ix_ma", "iy_ma", "iz_ma")
]
ROW_FORMAT = "<qqqHfff"
_TOLERANCE = 0.1  # of full scale, that a current may be off before it is said
_OLD_FRAMES = const(2)  # conversions that the chip still holds after a pause in reading it


class Hardware:
    def __init__(self):
        dac_bus = machine.SPI(board.DAC_SPI, baudrate=board.DAC_BAUD, polarity=0, phase=1)
        self.dac = Dac80504(dac_bus, _output(board.DAC_CS_PIN))
        self.coils = Coils(self.dac, board.DAC_CHANNELS, board.FULL_SCALE_MA)
        adc_bus = machine.SPI(board.ADC_SPI, baudrate=board.ADC_BAUD, polarity=0, phase=1)
        drdy = machine.Pin(board.ADC_DRDY_PIN, machine.Pin.IN)
        self.adc = Ads131m08(adc_bus, _output(board.ADC_CS_PIN), drdy, _output(board.ADC_RESET_PIN))

    def start(self):  # Fault where a chip is not what the board file says
        self.adc.start(board.ADC_RATIO_CODE, 0, 0)
        self.dac.start(board.DAC_GAIN)


class Clock:  # microseconds since it was made, from ticks that wrap
    def __init__(self):
        self._ticks = time.ticks_us()
        self._us = 0

    def now_us(self):
        ticks = time.ticks_us()
        self._us += time.ticks_diff(ticks, self._ticks)
        self._ticks = ticks
        return self._us

    def sleep_until(self, us):
        left_us = us - self.now_us()
        if left_us > 0:
            time.sleep_us(left_us)


class Readback:  # the coil currents, averaged; read() allocates nothing until its sums are done
    def __init__(self, adc):
        self._adc = adc
        self._frame = bytearray(FRAME_BYTES)
        self._sums = [0, 0, 0]

    def read(self):  # three sums of SAMPLES codes
        for _ in range(_OLD_FRAMES):
            self._adc.read_into(self._frame)
        sums, frame = self._sums, self._frame
        sums[0] = sums[1] = sums[2] = 0
        for _ in range(board.SAMPLES):
            self._adc.read_into(frame)
            for axis in range(3):
                at = 3 + 3 * board.ADC_CHANNELS[axis]
                word = frame[at] << 16 | frame[at + 1] << 8 | frame[at + 2]
                sums[axis] += word - ((word & 0x800000) << 1)
        return sums


def run():
    hardware = Hardware()
    writer = records.Writer(sys.stdout.buffer.write)
    clock = Clock()
    try:
        writer.json(records.HEADER, header())
        hardware.start()
        while True:
            play(hardware, writer, clock)
            writer.json(records.HEADER, header())  # for a reader that joins later
    except reasons.Fault as fault:
        _say(writer, clock, fault.code, fault.detail)
    except KeyboardInterrupt:
        return
    finally:
        hardware.coils.zero()


def header():
    return {
        "format": records.FORMAT,
        "role": "coil_driver",
        "board": board.BOARD,
        "firmware": VERSION,
        "uid": binascii.hexlify(machine.unique_id()).decode(),
        "boot": 0,  # not counted: this board keeps nothing
        "trajectory": trajectory.ID,
        "points": trajectory.POINTS,
        "ut_per_ma": board.UT_PER_MA,
        "columns": COLUMNS,
    }


def play(hardware, writer, clock):  # the whole table once; a row each point
    readback = Readback(hardware.adc)
    wrong = False
    for index in range(trajectory.POINTS):
        codes = struct.unpack_from("<HHH", trajectory.CODES, 6 * index)
        hardware.coils.set(codes)
        begin_us = clock.now_us()
        from_us, to_us = begin_us + board.SETTLE_US, begin_us + board.HOLD_US
        clock.sleep_until(from_us)
        sums = readback.read()
        mid_us = (from_us + clock.now_us()) // 2
        ma = [s * board.COIL_MA_PER_LSB / board.SAMPLES for s in sums]
        writer.frame(records.ROW, struct.pack(ROW_FORMAT, mid_us, from_us, to_us, index, *ma))
        if not wrong and not _follows(hardware.coils, codes, ma):
            wrong = True  # said once a turn
            _say(writer, clock, reasons.COIL_CURRENT, f"point {index}")
        clock.sleep_until(to_us)


def _follows(coils, codes, ma):
    off_ma = [abs(ma[i] - coils.current_ma(i, codes[i])) for i in range(3)]
    return max(off_ma) <= _TOLERANCE * min(board.FULL_SCALE_MA)


def _say(writer, clock, code, detail):
    values = {"detail": detail} if detail else {}
    writer.event(clock.now_us() / 1000000, code, reasons.name(code), reasons.text(code), values)


def _output(name):
    return machine.Pin(name, machine.Pin.OUT, value=1)
