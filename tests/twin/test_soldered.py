"""Pins and buses together: what flips the bridges, what is noted, what time is charged."""

import pytest
from barberpole.twin import World
from barberpole.twin.pins import PINS, bus_number
from barberpole.twin.soldered import Soldered


@pytest.fixture
def make(board):
    def build(*faults, seed=0, power_up=1):
        return Soldered(board, World.of(board), seed, power_up, frozenset(faults))

    return build


def pulse(soldered, name, t_us, width_us):
    soldered.pin(t_us, PINS.index(name), 1)
    soldered.pin(t_us + width_us, PINS.index(name), 0)


def state(soldered):
    return soldered.head.magnetisation


def send(soldered, name, bus, t_us, data):
    soldered.pin(t_us, PINS.index(name), 0)
    answer = soldered.transfer(t_us, bus_number(bus), data)
    soldered.pin(t_us, PINS.index(name), 1)
    return answer


def test_pulses_set_and_reset(make, board):
    soldered = make()
    pulse(soldered, board.flip.set_pin, 1000, 8)
    assert state(soldered) == [1, 1, 1]
    pulse(soldered, board.flip.reset_pin, 2000, 8)
    assert state(soldered) == [-1, -1, -1]
    assert soldered.incidents == []


def test_magnetisation_at_power_up_is_anything(make):
    seen = {tuple(state(make(power_up=n))) for n in range(30)}
    assert len(seen) > 4
    assert state(make(power_up=3)) == state(make(power_up=3))


def test_short_pulse_does_not_flip(make, board):
    soldered = make()
    pulse(soldered, board.flip.set_pin, 1000, 8)
    pulse(soldered, board.flip.reset_pin, 2000, 3)
    assert state(soldered) == [1, 1, 1]
    assert "3 µs is too short" in soldered.incidents[0]


def test_weak_pulse_does_not_flip(make, board):
    soldered = make("supply_low")
    before = state(soldered)
    pulse(soldered, board.flip.set_pin, 1000, 8)
    pulse(soldered, board.flip.reset_pin, 2000, 8)
    assert state(soldered) == before
    assert "too weak" in soldered.incidents[0]


def test_both_pins_high_is_a_fault_and_flips_nothing(make, board):
    soldered = make()
    pulse(soldered, board.flip.set_pin, 1000, 8)
    soldered.pin(2000, PINS.index(board.flip.set_pin), 1)
    pulse(soldered, board.flip.reset_pin, 2005, 8)
    soldered.pin(2020, PINS.index(board.flip.set_pin), 0)
    assert state(soldered) == [1, 1, 1]
    assert any("both flip pins" in incident for incident in soldered.truth(2020)["incidents"])


def test_coil_current_follows_the_code(make, board):
    soldered = make()
    assert soldered.head.current_ma == [0.0, 0.0, 0.0]
    send(soldered, board.dac.cs_pin, board.dac.spi, 1000, bytes((8 + board.dac.channels.coil_z, 0x40, 0x00)))
    assert soldered.head.current_ma[2] == pytest.approx(-0.5 * board.coils.full_scale_ma[2])


def test_nothing_answers_without_chip_select(make, board):
    assert make().transfer(0, bus_number(board.adc.spi), bytes(4)) == b"\xff" * 4


def test_nothing_answers_in_another_spi_mode(make, board):
    soldered = make()
    soldered.pin(0, PINS.index(board.adc.cs_pin), 0)
    for mode in (0, 2, 3):
        assert soldered.transfer(0, bus_number(board.adc.spi, mode), bytes(4)) == b"\xff" * 4
    assert soldered.transfer(0, bus_number(board.adc.spi, 1), bytes(4)) != b"\xff" * 4


def test_a_new_current_charges_the_arithmetic_of_a_point_once(make, board):
    soldered = make()
    pulse(soldered, board.flip.set_pin, 1000, 8)
    for channel in range(3):
        send(soldered, board.dac.cs_pin, board.dac.spi, 2000, bytes((8 + channel, 0x90, 0x00)))
    assert soldered.take_charge_us() == board.timing.python_us_per_selfcal_point
    assert soldered.take_charge_us() == 0


def test_the_last_sample_of_a_cycle_charges_the_arithmetic_of_a_row(make, board):
    soldered = make()
    t_us, charges = 10_000, []
    for name in (board.flip.set_pin, board.flip.reset_pin):
        pulse(soldered, name, t_us, 8)
        t_us += 8 + round(board.flip.settle_us)
        for _ in range(2 + board.adc.samples_per_half):
            t_us = max(t_us, soldered.ready_at(t_us))
            send(soldered, board.adc.cs_pin, board.adc.spi, t_us, bytes(30))
            charges.append(soldered.take_charge_us())
    assert charges[:-1] == [0] * (len(charges) - 1)
    assert charges[-1] == board.timing.python_us_per_row


def test_field_steps_while_the_coils_are_first_driven(make, board):
    soldered = make("ambient_step")
    before = soldered.truth(500_000)["field_ut"]
    send(soldered, board.dac.cs_pin, board.dac.spi, 600_000, bytes((8, 0xA0, 0x00)))
    assert soldered.truth(700_000)["field_ut"] == before
    assert soldered.truth(900_000)["field_ut"] != before
