"""The firmware's timer and converter set-up, proved from the registers that it writes (no board, RM0090's rules)."""

import contextlib
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from registers import UNITS_PER_US, Mcu, load
from registers.addresses import ADC, ADC1, COMMON_CCR, DAC, DMA2, RCC, RCC_AHB1ENR, STREAM0, TIM, TIM2, TIM8
from registers.mcu import ALTERNATE, written

RATES_HZ = (100, 150, 200, 500, 1000)
SCANS = {100: 80, 150: 60, 200: 40, 500: 20, 1000: 12}  # of half a cycle
PINS = {"Y1": "PC6", "Y2": "PC7", "X7": "PA6"} | {f"X{n}": f"P{p}" for n, p in ((1, "A0"), (2, "A1"), (3, "A2"))}
PINS |= {"X4": "PA3", "X19": "PC0", "X20": "PC1", "X21": "PC2", "X22": "PC3"}
OUTPUTS = {"PC6": 1, "PC7": 2}
TICK = 14 * 1.0  # of TIM8 in 1/168 µs
ADC_PINS = ("X19", "X20", "X21", "X22", "X1", "X2", "X3", "X4")
ADC_INPUTS = (10, 11, 12, 13, 0, 1, 2, 3)


def constants(rate_hz, **changed):
    """bp_board as a timed board has it."""
    return SimpleNamespace(
        **{
            "SET_PIN": "Y1",
            "RESET_PIN": "Y2",
            "SET_CHANNEL": 1,
            "RESET_CHANNEL": 2,
            "FLIP_AF": 3,
            "BREAK_PIN": "X7",
            "PULSE_US": 8,
            "DEAD_US": 1,
            "RATE_HZ": rate_hz,
            "SCAN_HZ": 2 * rate_hz * SCANS[rate_hz],
            "SAMPLES_PER_HALF": SCANS[rate_hz] * 3 // 4,
            "ADC_PINS": ADC_PINS,
            "ADC_CHANNELS": ADC_INPUTS,
            "RING_CYCLES": 24,
        }
        | changed
    )


class Bench:
    """A microcontroller with the firmware's sampler on it."""

    def __init__(self, rate_hz=1000, pauses=None, **changed):
        self.mcu = Mcu(OUTPUTS, pauses)
        self.modules = load(self.mcu, PINS, "bp_timers", "bp_scan", "bp_ring", "bp_timed", "bp_reasons")
        self.board = constants(rate_hz, **changed)
        self.pulses = self.modules.bp_timers.Pulses(self.board)
        self.sampler = self.modules.bp_timed.make(self.pulses, self.board)
        self.mcu.converter.source = self.codes
        self.seen = 0

    def codes(self, times, channels):
        """Codes that tell which half cycle and which scan they are of, with noise in the last bit."""
        timer = self.mcu.tim8
        half_units = timer.top * timer.tick
        half = (times - timer.began) // half_units
        place = (times - timer.began) % half_units * SCANS[self.board.RATE_HZ] // half_units
        code = np.where(half % 2, 0, 2048) + half // 2 % 32 * 60 + place + 1
        return np.repeat(code[:, None], len(channels), axis=1)

    def reset_pulse_units(self, cycle):
        """When the RESET pulse of a cycle is at its centre."""
        timer = self.mcu.tim8
        return timer.began + (2 * cycle + 1) * timer.top * timer.tick

    def read(self):
        """One more cycle; its number by time, and by its SET and its RESET codes (modulo 32)."""
        board, sampler = self.board, self.sampler
        sampler.clear()
        sampler.cycle()
        scans, samples = SCANS[board.RATE_HZ], board.SAMPLES_PER_HALF
        places = samples * (2 * scans - samples + 1) // 2  # sum of 1 + place over the scans that are kept
        by_set, by_reset = ((sampler.sums[i] + 2048 * samples - places) / samples for i in (0, 3))
        return self.by_time(sampler.mid_us), (by_set - 2048) / 60, by_reset / 60

    def by_time(self, mid_us):
        timer = self.mcu.tim8
        passed = (mid_us * UNITS_PER_US - timer.began) / (timer.top * timer.tick)
        return (passed - 1) / 2


def pulses(mcu, name):
    """(start, end) of each pulse on a pin, in 1/168 µs; the pin was never left floating after it was first driven."""
    mcu.catch_up()
    levels = mcu.levels[name][1:]
    assert levels[0][1] == 0
    assert all(level in (0, 1) for _, level in levels)
    rises = [t for t, level in levels if level == 1]
    falls = [t for (_, before), (t, level) in pairwise(levels) if before == 1 and level == 0]
    return list(zip(rises, falls, strict=False))


def overlap(mcu):
    """Whether SET and RESET were ever on together."""
    both = sorted(pulses(mcu, "PC6") + pulses(mcu, "PC7"))
    return any(second[0] < first[1] for first, second in pairwise(both))


@pytest.mark.parametrize("rate_hz", RATES_HZ)
def test_pulses_are_within_a_tick_of_the_request(rate_hz):
    bench = Bench(rate_hz)
    for _ in range(5):
        bench.read()
    sets, resets = pulses(bench.mcu, "PC6"), pulses(bench.mcu, "PC7")
    assert len(sets) >= 4
    assert len(resets) >= 5
    assert resets[0][0] < sets[0][0]  # half a SET pulse at the start is held back
    for start, end in sets + resets:
        assert abs((end - start) - 8 * UNITS_PER_US) <= TICK
    half = 1e6 * UNITS_PER_US / (2 * rate_hz)
    centres = sorted((start + end) / 2 for start, end in sets + resets)
    for first, second in pairwise(centres):
        assert abs(second - first - half) <= TICK
    assert not overlap(bench.mcu)


@pytest.mark.parametrize("rate_hz", RATES_HZ)
def test_scans_have_their_phase_and_settle(rate_hz):
    bench = Bench(rate_hz)
    for expected in range(1, 40):
        by_time, by_set, by_reset = bench.read()
        assert by_time == pytest.approx(expected, abs=0.01)
        assert by_set == by_reset == expected % 32
    plan, sampler = bench.sampler._plan, bench.sampler
    first_us = (plan.scans - sampler.samples + 0.5) * plan.beat / 84
    assert first_us - 4 > 100  # settled since the pulse ended (thesis 5.3.1)
    assert sampler.lost == 0


def test_idle_is_low_and_driven_before_the_pins_are_the_timers():
    bench = Bench()
    bench.read()
    journal = bench.mcu.journal
    mode, function = 0x4002_0800, 0x4002_0820  # GPIOC MODER and AFRL
    muxed = next(i for i, (_, at, value) in enumerate(journal) if at == mode and value >> 12 & 3 == ALTERNATE)
    before = {at: value for _, at, value in journal[:muxed]}
    assert before[TIM8 + TIM["CR2"]] >> 8 == 0  # OIS1 to OIS4
    assert before[TIM8 + TIM["BDTR"]] & 0x8C00 == 0x0C00  # outputs off, and driven while they are
    assert before[TIM8 + TIM["CCER"]] == 0x11  # no complementary output
    assert before[function] >> 24 & 15 == 3
    assert [level for _, level in bench.mcu.levels["PC6"]][:2] == [None, 0]
    assert before[mode] >> 12 & 3 == 1  # low outputs until then


def test_clocks_and_interrupts():
    bench = Bench()
    bench.read()
    mcu = bench.mcu
    assert written(mcu, COMMON_CCR)[-1] >> 16 & 3 == 1
    assert 168 / mcu.converter.clock_units <= 36  # MHz, data sheet; 21 here
    assert mcu.converter.channels == list(ADC_INPUTS)
    assert all(value & 0x1E == 0 for value in written(mcu, STREAM0))  # TCIE HTIE TEIE DMEIE
    assert written(mcu, STREAM0)[-1] & 0x0E03_FDE1 == 0x0003_2D01 & 0x0E03_FDE1  # channel 0, 16 bits, circular, on
    assert not [at for _, at, _ in mcu.journal if at in (TIM8 + TIM["DIER"], TIM2 + TIM["DIER"])]
    assert mcu.cells[RCC + RCC_AHB1ENR] & 1 << 22
    assert written(mcu, ADC1 + ADC["CR1"])[-1] == 0x100  # scan, no interrupt
    assert not [at for _, at, _ in mcu.journal if DAC <= at < DAC + 0x40 or at == DMA2 + 4]


def test_rates_change_without_overlap_or_short_pulse():
    bench = Bench(100, RING_CYCLES=24)
    for number in range(30):
        rate_hz = RATES_HZ[number * 7 % 5]
        bench.board.RATE_HZ = rate_hz
        bench.board.SCAN_HZ = 2 * rate_hz * SCANS[rate_hz]
        bench.sampler.samples = SCANS[rate_hz] * 3 // 4
        bench.sampler.retime(rate_hz)
        bench.board.SAMPLES_PER_HALF = bench.sampler.samples
        for expected in range(1, 4):
            _, by_set, by_reset = bench.read()
            assert by_set == by_reset == expected
        bench.mcu.wait(number * 9973)  # the change comes at any phase
    assert not overlap(bench.mcu)
    widths = [end - start for name in OUTPUTS for start, end in pulses(bench.mcu, name)]
    assert max(widths) <= 8 * UNITS_PER_US + TICK


@pytest.mark.parametrize("moment", range(1, 1200, 29))
def test_every_way_out_leaves_both_pins_low(moment):
    """An error at any register access of start, streaming and stop: then off()."""
    bench = Bench()
    countdown = [moment]

    def fail(units, wait=bench.mcu.wait):
        wait(units)
        countdown[0] -= 1
        if countdown[0] == 0:
            raise KeyboardInterrupt

    bench.mcu.wait = fail
    try:
        while True:
            bench.read()
    except KeyboardInterrupt:
        bench.sampler.stop()
    bench.mcu.wait(50_000 * UNITS_PER_US)
    bench.mcu.catch_up()
    assert [bench.mcu.levels[name][-1][1] for name in OUTPUTS] == [0, 0]
    assert all(bench.mcu.levels[name][-1][0] < bench.mcu.now - 49_000 * UNITS_PER_US for name in OUTPUTS)
    assert not overlap(bench.mcu)


@pytest.mark.parametrize("moment", range(1, 24))
def test_a_second_interrupt_while_it_stops_changes_nothing(moment):
    bench = Bench()
    bench.read()
    countdown = [moment]

    def fail(units, wait=bench.mcu.wait):
        wait(units)
        countdown[0] -= 1
        if countdown[0] == 0:
            raise KeyboardInterrupt

    bench.mcu.wait = fail
    with contextlib.suppress(KeyboardInterrupt):
        bench.sampler.stop()
    countdown[0] = -1
    stopped = bench.mcu.now
    bench.mcu.wait(50_000 * UNITS_PER_US)
    bench.mcu.catch_up()
    assert [bench.mcu.levels[name][-1][1] for name in OUTPUTS] == [0, 0]
    assert all(bench.mcu.levels[name][-1][0] <= stopped for name in OUTPUTS)


def test_break_input_stops_the_pulses_in_hardware():
    bench = Bench()
    bench.read()
    bench.mcu.wait(UNITS_PER_US * 100)
    bench.mcu.break_input()
    killed = bench.mcu.now
    with pytest.raises(bench.modules.bp_reasons.Fault) as caught:
        bench.read()
    assert caught.value.code == bench.modules.bp_reasons.FLIP_STOPPED
    assert all(end <= killed for name in OUTPUTS for _, end in pulses(bench.mcu, name))
    with pytest.raises(bench.modules.bp_reasons.Fault):  # and they stay off while the loop is open
        bench.sampler.cycle()
    assert all(end <= killed for name in OUTPUTS for _, end in pulses(bench.mcu, name))


def test_what_the_timers_cannot_do_is_refused():
    plan = Bench().modules.bp_timers.Plan
    with pytest.raises(ValueError, match="too close"):
        plan(1000, 499.5, 1, 12, 168_000_000, 84_000_000)
    with pytest.raises(ValueError, match="at least 8 Hz"):
        plan(5, 8, 1, 12, 168_000_000, 84_000_000)
    with pytest.raises(ValueError, match="too many"):
        plan(1000, 8, 1, 110, 168_000_000, 84_000_000)
    with pytest.raises(ValueError, match="too long for DMA"):
        Bench(100, RING_CYCLES=64)


@pytest.mark.parametrize("pause_ms", [0, 9, 40])
@pytest.mark.parametrize("before_us", [3, 700, 12_345])
def test_ticks_that_wrap_cost_no_cycle(before_us, pause_ms):
    """Ticks begin anew at 2^30 µs, in the middle of a cycle, of its reading, or of a pause of the program."""
    bench = Bench(1000)
    bench.mcu.wait(((1 << 30) - 10_000 - before_us) * UNITS_PER_US)
    times, numbers = [], []
    for number in range(60):
        _, by_set, by_reset = bench.read()
        assert by_set == by_reset
        numbers.append(by_set)
        times.append(bench.sampler.mid_us)
        bench.mcu.wait((1000 * pause_ms if number == 8 else ROW_US) * UNITS_PER_US)
    assert times[0] > times[-1]
    skipped = np.diff(numbers) % 32 - 1
    assert bench.sampler.lost == skipped.sum()
    assert bool(skipped.sum()) == (pause_ms > 24)  # the ring's depth
    passed_us = np.diff(times) % (1 << 30)
    np.testing.assert_allclose(passed_us, 1000 * (skipped + 1), atol=2)


CYCLES = 10_000
ROW_US = 450  # what the program does with a cycle before it asks for the next


def collector(seconds, shortest_ms, longest_ms, seed):
    """A pause of the program in every second, at a random moment: (start, length) in 1/168 µs."""
    rng = np.random.default_rng(seed)
    for second in range(seconds):
        moment_s, length_ms = second + rng.uniform(0.02, 0.98), rng.uniform(shortest_ms, longest_ms)
        yield round(moment_s * 1e6 * UNITS_PER_US), round(length_ms * 1e3 * UNITS_PER_US)


def test_no_collector_pause_costs_a_sample():
    """10 000 flips at 1 kHz, every second a pause of 4 to 12 ms at any access, even between two looks at a clock."""
    bench = Bench(1000, collector(12, 4.0, 12.0, 5))
    behind = 0
    for expected in range(1, CYCLES + 1):
        by_time, by_set, by_reset = bench.read()
        assert (round(by_time), by_set, by_reset) == (expected, expected % 32, expected % 32)
        bench.mcu.wait(ROW_US * UNITS_PER_US)
        behind = max(behind, bench.mcu.now - bench.reset_pulse_units(expected))
    assert bench.sampler.lost == 0
    assert behind > 4e3 * UNITS_PER_US  # the pauses were there


@pytest.mark.parametrize("before", [True, False])
def test_a_pause_between_the_looks_at_the_clock_and_at_the_place_is_no_slip(before):
    bench = Bench(1000)
    bench.read()
    pauses = iter([12_000 * UNITS_PER_US])

    def position(look=bench.sampler._ring._position):
        if before:
            bench.mcu.wait(next(pauses, 0))
        place = look()
        if not before:
            bench.mcu.wait(next(pauses, 0))
        return place

    bench.sampler._ring._position = position
    for expected in range(2, 20):
        by_time, by_set, by_reset = bench.read()
        assert (round(by_time), by_set, by_reset) == (expected, expected, expected)
    assert bench.sampler.lost == 0


@pytest.mark.parametrize("pause_ms", [24, 40, 170, 5000])
def test_a_pause_longer_than_the_ring_is_counted_and_survived(pause_ms):
    bench = Bench(1000)
    numbers = []
    for number in range(60):
        by_time, by_set, by_reset = bench.read()
        numbers.append(round(by_time))
        assert by_set == by_reset == numbers[-1] % 32  # what is read is never mislabelled
        bench.mcu.wait((pause_ms * 1000 if number == 20 else ROW_US) * UNITS_PER_US)
    missing = numbers[-1] - numbers[0] + 1 - len(numbers)
    assert bench.sampler.lost == missing
    assert pause_ms - 24 <= missing <= pause_ms  # at most the depth of the ring is saved
    assert all(second > first for first, second in pairwise(numbers))


@pytest.mark.parametrize("beats", [2, 3, 12, 24, 31])
def test_missed_scans_are_noticed_before_they_are_believed(beats):
    """A whole half cycle is 12 of them: every place of the ring would be read as the other magnetisation."""
    bench = Bench(1000)
    for _ in range(10):
        bench.read()
    before = bench.sampler.lost
    bench.mcu.converter.swallow = beats
    wrong = 0
    for _ in range(20):
        by_time, by_set, by_reset = bench.read()
        wrong += by_set != by_reset or round(by_time) % 32 != by_set
    assert wrong == 0
    assert bench.sampler.lost > before


def test_a_dma_clock_that_is_switched_off_comes_back():
    """MicroPython does so 64 ms after its own last transfer on that controller (dma.c)."""
    bench = Bench(1000)
    for _ in range(10):
        bench.read()
    bench.mcu.catch_up()
    bench.mcu.cells[RCC + RCC_AHB1ENR] &= ~(1 << 22)
    for _ in range(10):
        by_time, by_set, by_reset = bench.read()
        assert by_set == by_reset == round(by_time) % 32
    assert bench.sampler.lost > 0
    assert bench.mcu.cells[RCC + RCC_AHB1ENR] & 1 << 22


def test_a_converter_that_never_answers_is_told():
    bench = Bench(1000)
    bench.read()
    bench.mcu.converter.swallow = 10**6
    with pytest.raises(bench.modules.bp_reasons.Fault) as caught:
        bench.read()
    assert caught.value.code == bench.modules.bp_reasons.ADC_SILENT
    assert [bench.mcu.levels[name][-1][1] for name in OUTPUTS] == [0, 0]


def test_fresh_leaves_out_what_was_sampled_before():
    bench = Bench(1000)
    bench.read()
    bench.mcu.wait(9500 * UNITS_PER_US)
    now = bench.mcu.now
    bench.sampler.fresh()
    bench.read()
    assert bench.sampler.mid_us * UNITS_PER_US - 500 * UNITS_PER_US > now
    assert bench.sampler.lost == 0


@pytest.mark.parametrize("code", [0, 4095])
def test_the_ends_of_the_converter_and_a_stuck_one_are_told(code):
    bench = Bench(1000)
    bench.mcu.converter.source = lambda times, channels: np.full((len(times), len(channels)), code)
    bench.sampler.clear()
    bench.sampler.cycle()
    assert bench.sampler.clipped == 0b111
    with pytest.raises(bench.modules.bp_reasons.Fault) as caught:
        bench.sampler.check()
    assert caught.value.code == bench.modules.bp_reasons.SATURATED
    bench.mcu.converter.source = lambda times, channels: np.full((len(times), len(channels)), 77)
    bench.sampler.fresh()
    bench.sampler.clear()
    bench.sampler.cycle()
    with pytest.raises(bench.modules.bp_reasons.Fault) as caught:
        bench.sampler.check()
    assert caught.value.code == bench.modules.bp_reasons.ADC_STUCK
