# check_sampler.py: sums over flip cycles, what counts as clipped or stuck, and that nothing is allocated.
import micropython

import bp_compensate
import bp_reasons as reasons
from bp_sampler import BRIDGE, COIL, SUPPLY, Sampler
from fakes import Adc, Board, Flip, raises, run

COUNT = [0]


def lively(channel, state):  # signed codes that differ from sample to sample, mean 1000 (channel + 1) * state
    COUNT[0] += 1
    return (1000 * (channel + 1) * (state or 1) + (1 if COUNT[0] // 8 % 2 else -1)) & 0xFFFFFF


def sampler_of(words):
    COUNT[0] = 0
    adc = Adc(words)
    return Sampler(adc, Flip(adc), Board), adc


def check_sums_and_means():
    sampler, adc = sampler_of(lively)
    sampler.clear()
    sampler.cycle()
    sampler.cycle()
    sampler.check()
    assert adc.frames == 2 * 2 * (4 + 2)  # cycles, halves, samples and what the chip still held
    assert list(sampler.sums)[:6] == [8000, 16000, 24000, -8000, -16000, -24000], list(sampler.sums)
    assert bp_compensate.means_lsb(sampler) == (1000.0, 2000.0, 3000.0, -1000.0, -2000.0, -3000.0)
    assert abs(sampler.sums[BRIDGE]) <= 4 and abs(sampler.sums[COIL + 2]) <= 4 and abs(sampler.sums[SUPPLY]) <= 4
    sampler.clear()
    assert sampler.cycles == 0 and not any(sampler.sums)


def check_cycle_allocates_nothing():
    sampler, _ = sampler_of(lambda channel, state: channel)
    sampler.clear()
    micropython.heap_lock()
    try:
        sampler.cycle()
    finally:
        micropython.heap_unlock()


def check_clipped_is_told():
    for end in (0x7FFFFF, 0x800000):
        sampler, _ = sampler_of(lambda channel, state, end=end: end if channel == 1 else lively(channel, state))
        sampler.clear()
        sampler.cycle()
        assert sampler.clipped == 0b010
        assert raises(reasons.Fault, sampler.check).code == reasons.SATURATED


def check_stuck_is_told():
    sampler, _ = sampler_of(lambda channel, state: 123)
    sampler.clear()
    sampler.cycle()
    assert raises(reasons.Fault, sampler.check).code == reasons.ADC_STUCK


class Calibration:
    FACTORY_OFFSET_LSB = (0.0, 0.0, 0.0)

    @staticmethod
    def undo(xs, ys, zs, xr, yr, zr, t, gx, gy, gz):
        return (xs + xr) / 2 / gx, (ys + yr) / 2 / gy, (zs + zr) / 2 / gz


class Stored:
    gain = (2.0, 1.0, 1.0)
    offset_lsb = (10.0, 0.0, 0.0)
    shift_ut = (0.0, 5.0, 0.0)


def check_compensation_composes_gain_offset_and_shift():
    compensator = bp_compensate.Compensator(Board, Calibration)
    means = (110.0, 200.0, 300.0, -90.0, -200.0, -300.0)
    assert compensator.field_ut(means, 25.0) == (100.0, 200.0, 300.0)
    compensator.put_in_force(Stored)
    assert compensator.field_ut(means, 25.0) == (50.0, 195.0, 300.0)


def check_temperature_current_and_supply():
    sampler, _ = sampler_of(lambda channel, state: 4000000 + COUNT[0] % 2)
    sampler.clear()
    sampler.cycle()
    compensator = bp_compensate.Compensator(Board, Calibration)
    assert abs(compensator.temp_c(sampler) - 25.0) < 1e-3
    assert abs(compensator.coil_ma(sampler)[1] - 4.0) < 1e-5
    assert abs(compensator.supply_v(sampler) - 8.0) < 1e-5


run(globals())
