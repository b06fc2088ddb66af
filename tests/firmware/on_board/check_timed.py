# check_timed.py: the timed sampler in MicroPython itself, on a ring that a clock fills: sums, pauses, no allocation,
# and what it does when the hardware fails. The registers are proved elsewhere (test_timers.py).
import micropython

import bp_reasons as reasons
from fakes import raises, run
from timed_fakes import CYCLE_US, KEPT, SCANS, SLIPPED, SLOTS, sampler_of, time


def check_sums_have_their_phase():
    sampler = sampler_of()
    sampler.cycle()
    sampler.cycle()
    kept = 2 * KEPT
    assert list(sampler.sums)[:6] == [kept * (2000 + 100 * i - 2048) + KEPT for i in range(3)] + [
        kept * (1000 + 100 * i - 2048) + KEPT for i in range(3)
    ], list(sampler.sums)
    assert sampler.cycles == 2 and sampler.lost == 0
    sampler.check()


def check_cycle_allocates_nothing():
    sampler = sampler_of()
    sampler.cycle()
    micropython.heap_lock()
    try:
        for _ in range(3):
            sampler.clear()
            sampler.cycle()
        sampler.fresh()
        sampler.cycle()
    finally:
        micropython.heap_unlock()
    assert sampler.lost == 0


def check_a_pause_within_the_ring_costs_nothing_and_a_longer_one_is_counted():
    sampler = sampler_of()
    sampler.cycle()
    before = sampler.mid_us
    time.sleep_us(120000)
    for _ in range(5):
        sampler.cycle()
    assert sampler.lost == 0 and sampler.mid_us - before == 50000
    time.sleep_us(300000)
    sampler.cycle()
    missing = (sampler.mid_us - before - 50000) // 10000 - 1
    assert sampler.lost == missing > 0, (sampler.lost, missing)


def check_a_place_that_stands_still_is_a_slip():
    sampler = sampler_of()
    sampler.cycle()
    sampler._scan.held = sampler._scan.position()
    time.sleep_us(5000)
    assert sampler._ring.behind() == SLIPPED


def check_a_converter_that_was_silent_for_a_moment_costs_the_cycles_since_the_last():
    sampler = sampler_of()
    sampler.cycle()
    before = sampler.cycles
    sampler._scan.silences = 1
    sampler.cycle()
    assert sampler.cycles == before + 1 and sampler._scan.starts == 2
    assert sampler.lost == 1, sampler.lost


def check_a_converter_that_stays_silent_is_told_and_the_pulses_end():
    sampler = sampler_of()
    sampler.cycle()
    sampler._scan.silences = 1000
    assert raises(reasons.Fault, sampler.cycle).code == reasons.ADC_SILENT
    assert not sampler._pulses.on and sampler._scan.starts == 4  # it was begun anew three times


def check_a_broken_loop_is_told_and_nothing_begins_anew():
    sampler = sampler_of()
    sampler.cycle()
    sampler._pulses.broken = True
    assert raises(reasons.Fault, sampler.cycle).code == reasons.FLIP_STOPPED
    assert not sampler._pulses.on and sampler._scan.starts == 1


def check_what_was_overwritten_while_it_was_read_is_not_taken():
    sampler = sampler_of()
    sampler.cycle()
    before, half = sampler.mid_us, sampler._half
    waits = [SLOTS * CYCLE_US + 3000]

    def slow(into, first):
        half(into, first)
        if waits:
            time.sleep_us(waits.pop())

    sampler._half = slow
    sampler.clear()
    sampler.cycle()
    assert sampler.cycles == 1  # and that one is whole
    assert sampler.sums[0] == KEPT * (2000 - 2048) + KEPT // 2, list(sampler.sums)
    assert (sampler.mid_us - before) // CYCLE_US - 1 == sampler.lost > 0, sampler.lost


def check_fresh_begins_anew_where_scans_were_missed():
    sampler = sampler_of()
    sampler.fresh()
    sampler.cycle()
    assert sampler._scan.starts == 1
    sampler._scan.held = sampler._scan.position()
    time.sleep_us(5000)
    sampler.fresh()
    assert sampler._scan.starts == 2


def check_the_ends_of_the_converter_are_told_by_axis():
    for code in (0, 4095):
        sampler = sampler_of()
        last_of_half = 2 * SCANS + SCANS - 1  # after the SET pulse, of the first cycle that is read
        sampler._scan.ring[8 * last_of_half + 1] = code  # of y
        sampler.cycle()
        assert sampler.clipped == 0b010
        assert raises(reasons.Fault, sampler.check).code == reasons.SATURATED


def check_an_axis_whose_samples_never_differ_is_stuck():
    sampler = sampler_of()
    for i in range(2, len(sampler._scan.ring), 8):
        sampler._scan.ring[i] = 1234
    sampler.cycle()
    assert sampler.clipped == 0
    assert raises(reasons.Fault, sampler.check).code == reasons.ADC_STUCK


run(globals())
