"""Frames told ahead of their reading are those that the reading finds, and to tell them changes nothing."""

from dataclasses import replace

import numpy as np
import pytest
from barberpole.twin import Tumble, World
from barberpole.twin.frames import FRAME_BYTES as FRAME
from barberpole.twin.frames import NOTHING
from barberpole.twin.pins import PINS, bus_number
from barberpole.twin.soldered import Soldered
from barberpole.twin.temperature import Cycle

HALVES = 40
WORLDS = {
    "still": {},
    "flicker": {"flicker": 1.0},
    "warming": {"temperature": Cycle(period_s=20.0, rest_s=0.05)},
    "tumbling": {"ambient": Tumble()},
}


class Program:
    """Flips, waits and reads as the firmware does; with `ahead` it takes its frames from what is told, if it can."""

    def __init__(self, board, world, faults, ahead):
        self.board, self.ahead = board, ahead
        self.soldered = Soldered(board, world, 5, 1, frozenset(faults))
        self.rng, self.rng_ahead = np.random.default_rng(9), np.random.default_rng(10)
        self.now_us = 10_000
        self.told, self.taken = NOTHING, 0
        self.read_frames, self.charges, self.requests = [], [], 0

    def half(self, pin):
        board, rng = self.board, self.rng
        self.settle_accounts()
        for level, t_us in ((1, self.now_us), (0, self.now_us + 8)):
            self.soldered.pin(t_us, PINS.index(pin), level)
        if rng.random() < 0.3:  # a new coil current
            code = int(rng.integers(0x6000, 0xA000))
            channel = board.dac.channels.coil_x + int(rng.integers(3))
            self.send(board.dac.cs_pin, board.dac.spi, bytes((8 + channel, code >> 8, code & 0xFF)))
        self.now_us += 8 + round(board.flip.settle_us)
        for _ in range(int(rng.integers(1, 13))):
            if rng.random() < 0.1:  # the collector
                self.now_us += int(rng.integers(400))
            self.now_us = max(self.now_us, self.next_ready()) + int(rng.integers(12))
            self.read()

    def next_ready(self):
        return self.told.ready_us[self.taken] if self.told.count else self.soldered.ready_at(self.now_us)

    def read(self):
        at, told = self.taken, self.told
        if at < told.count and told.ready_us[at] <= self.now_us < told.ready_us[at + 2]:
            self.read_frames.append(told.frames[FRAME * at : FRAME * (at + 1)])
            self.taken += 1
            if self.taken == told.count and told.charge_us:
                self.charges.append((self.now_us, told.charge_us))
            return
        self.settle_accounts()
        board = self.board
        self.read_frames.append(self.send(board.adc.cs_pin, board.adc.spi, bytes(FRAME), release=False))
        if self.ahead:
            self.told = self.soldered.ahead(int(self.rng_ahead.integers(16)))

    def settle_accounts(self):
        if self.told.count:
            self.soldered.take(self.taken)
            whole = self.taken == self.told.count
            assert self.soldered.take_charge_us() == (self.told.charge_us if whole else 0)
            self.told, self.taken = NOTHING, 0
        self.soldered.pin(self.now_us, PINS.index(self.board.adc.cs_pin), 1)

    def send(self, name, bus, data, release=True):
        self.requests += 1
        self.soldered.pin(self.now_us, PINS.index(name), 0)
        answer = self.soldered.transfer(self.now_us, bus_number(bus), data)
        if charge := self.soldered.take_charge_us():
            self.charges.append((self.now_us, charge))
        if release:
            self.soldered.pin(self.now_us, PINS.index(name), 1)
        return answer

    def run(self):
        for _ in range(HALVES):
            self.half(self.board.flip.set_pin)
            self.half(self.board.flip.reset_pin)
        return self


@pytest.mark.parametrize("faults", [(), ("adc_stuck",), ("ambient_step",)])
@pytest.mark.parametrize("kind", WORLDS)
def test_a_program_reads_the_same_with_and_without(board, kind, faults):
    world = replace(World.of(board), **WORLDS[kind])
    plain, ahead = (Program(board, world, faults, ahead).run() for ahead in (False, True))
    assert ahead.read_frames == plain.read_frames
    assert ahead.charges == plain.charges
    assert plain.charges  # rows and points were charged for
    assert len({frame[3:6] for frame in plain.read_frames}) > 100 or "adc_stuck" in faults
    assert ahead.requests < 0.6 * plain.requests


def test_nothing_is_told_ahead_of_a_command_or_by_a_silent_converter(board):
    for faults, data in (((), bytes((0xA0, 0)) + bytes(28)), (("adc_silent",), bytes(FRAME))):
        program = Program(board, World.of(board), faults, ahead=True)
        program.send(board.adc.cs_pin, board.adc.spi, data, release=False)
        assert program.soldered.ahead(9) == NOTHING


def test_nothing_is_told_of_a_converter_that_is_not_selected(board):
    program = Program(board, World.of(board), (), ahead=True)
    program.send(board.adc.cs_pin, board.adc.spi, bytes(FRAME))
    assert program.soldered.ahead(9) == NOTHING
