# fakes.py: pins, buses and chips for the firmware's checks, which run in MicroPython on the PC.
import time


class Pin:
    def __init__(self, level=0, name="", journal=None):
        self.level = level
        self._name = name
        self._journal = journal

    def value(self, level=None):
        if level is None:
            return self.level
        self.level = level
        if self._journal is not None:
            self._journal.append((self._name, level))
        return None


class Spi:  # answers with the frames it was given, and keeps what was written
    def __init__(self, answers=(), keep=True):
        self.answers = list(answers)
        self.written = []
        self._keep = keep

    def write_readinto(self, out, into):
        if self._keep:
            self.written.append(bytes(out))
        answer = self.answers.pop(0) if self.answers else bytes(len(into))
        into[:] = answer


class Adc:  # conversions without a bus: words(channel, state) gives the code; state follows the flip pins
    old_frames = 2
    clip = 0x7FFFFF

    def __init__(self, words):
        self._words = words
        self.state = 0
        self.frames = 0

    def read_into(self, frame):
        self.frames += 1
        for channel in range(8):
            word = self._words(channel, self.state)
            at = 3 + 3 * channel
            frame[at] = word >> 16 & 255
            frame[at + 1] = word >> 8 & 255
            frame[at + 2] = word & 255


class Flip:
    def __init__(self, adc):
        self._adc = adc
        self.pulses = []

    def set(self):
        self._adc.state = 1

    def reset(self):
        self._adc.state = -1

    def off(self):
        self._adc.state = 0


class Dac:
    zero = 32768

    def __init__(self):
        self.codes = [0] * 4

    def write(self, channel, code):
        self.codes[channel] = code


class Board:
    SETTLE_US = 0
    HALF_US = 10
    SAMPLES_PER_HALF = 4
    ADC_CHANNELS = (0, 1, 2, 3, 4, 5, 6, 7)
    TEMP_AT_0_C = -375.0
    TEMP_C_PER_LSB = 1e-4
    COIL_MA_PER_LSB = 1e-6
    SUPPLY_V_PER_LSB = 2e-6
    SETTLE_CYCLES = 1
    CYCLES_PER_POINT = 2
    CURRENT_TOLERANCE = 0.1
    AMBIENT_STEP_LIMIT_UT = 0.3


def raises(kind, call, *arguments):
    try:
        call(*arguments)
    except kind as error:
        return error
    raise AssertionError("%s was not raised" % kind)


def run(names):  # every check_ of a file, in order
    for name in sorted(names):
        if name.startswith("check_"):
            begin = time.ticks_ms()
            names[name]()
            print("ok", name, time.ticks_diff(time.ticks_ms(), begin), "ms")
