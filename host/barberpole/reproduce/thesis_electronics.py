"""Thesis 3.4.3 to 3.6 and 5.1.1.2: flipping as a chopper, amplifier noise, feedback."""

import math
from functools import cache, partial

import numpy as np

from barberpole.board import load_sensor
from barberpole.design import amplifier, chopper, feedback, flipping
from barberpole.design.parts import AMPLIFIERS, Amplifier, find_amplifier
from barberpole.law.reading import reading_error_ut
from barberpole.reproduce.row import Row
from barberpole.units import UT_PER_GAUSS

_row = partial(Row, "thesis")

CAPACITOR_NF, STRAP_V, EXAMPLE_HZ, EXAMPLE_MW = 220.0, 12.0, 1000.0, 32.0  # 3.4.3
FLIP_HZ, CORNER_HZ = 200.0, 10.0  # 3.4.3 and the data sheet's corner

BRICK_WALL = (1.57, 1.22, 1.16, 1.13, 1.12)  # table 3.1
OPA4377_NV, OPA4377_FA = 7.5, 2.0  # 3.5
GAIN, CUTOFF_HZ = 60.0, 1000.0  # 3.5
BRIDGE_OHM = 1100.0  # HMC102x
THERMAL, INPUT, CURRENT, U3, BUFFER, TOTAL, RMS = 37.0, 329.0, 31.0, 7.5, 20.0, 334.0, 1.32e4  # table 3.2
BRIDGE_OHM_HMC1001, SENSITIVITY_HMC1001, SUPPLY_V_HMC1001 = 850.0, 320.0, 10.0  # nV/nT: 3.2 mV/V/G on 10 V (3.6)
SENSITIVITY_HMC1021 = 55.0  # nV/nT: 1 mV/V/G (3.6) on 5 mA in 1100 ohm (3.4.2)

ONE_GAUSS_UT = 1.0 * UT_PER_GAUSS
COILS = (  # table 5.1: ohm, mA for one gauss, mW
    (feedback.OffsetCoil("HMC1001", 1.5, 50.0 / ONE_GAUSS_UT), 3.8),
    (feedback.OffsetCoil("HMC1021", 8.0, 5.0 / ONE_GAUSS_UT), 0.2),
    (feedback.OffsetCoil("KMZ51", 170.0, 4.0 / ONE_GAUSS_UT), 2.7),
)
DATA_SHEET_COILS = tuple(
    feedback.OffsetCoil(name, sensor.offset_coil_ohm, 1.0 / sensor.offset_coil_ut_per_ma)
    for name, sensor in (("HMC1001", load_sensor("hmc1001_1002")), ("HMC1021", load_sensor("hmc1021_1022")))
)
LOOP_GAIN = 100.0  # an example: the thesis gives none


def rows() -> list[Row]:
    """All of them, in the order of the thesis."""
    return [*_power(), *_chopper(), *_brick_wall(), *_table_3_2(), *_whole(), *_sensors(), *_feedback()]


def _power() -> list[Row]:
    half = flipping.FlipCircuit(CAPACITOR_NF, STRAP_V)
    full = flipping.FlipCircuit(CAPACITOR_NF, STRAP_V, flipping.FULL_BRIDGE)
    why = "4 C V² f: the bridge of fig. 3.14 swings the capacitor from −V to +V; C V² f is the half bridge's"
    return [
        _row("3.4.3", "C V² f, 220 nF, 12 V, 1 kHz", EXAMPLE_MW, flipping.flip_power_mw(half, EXAMPLE_HZ), "mW"),
        _row("fig. 3.15", "the same through a full bridge", None, flipping.flip_power_mw(full, EXAMPLE_HZ), "mW", why),
        _row("fig. 3.15", "C V² f at 200 Hz", None, flipping.flip_power_mw(half, FLIP_HZ), "mW"),
    ]


CHAIN = chopper.Chain(FLIP_HZ, signal_hz=5.0, signal_nt=10.0, white_nt_per_rthz=0.1, corner_hz=CORNER_HZ)
RESOLUTION_HZ = 0.5  # of the spectra
QUIET_HZ = (10.0, 30.0)  # band of the noise: above the signal, far below the flip rate


@cache
def _stages() -> chopper.Stages:
    return chopper.simulate(CHAIN, seconds=60.0, cutoff_hz=QUIET_HZ[1], seed=1)


def _power_between(values: np.ndarray, low_hz: float, high_hz: float) -> float:
    """Mean power density of a stage over a band."""
    frequency_hz, found = chopper.density(values, _stages().sample_hz, RESOLUTION_HZ)
    band = (frequency_hz >= low_hz) & (frequency_hz <= high_hz)
    return float(np.mean(found[band] ** 2))


def _chopper() -> list[Row]:
    stages = _stages()
    band = np.linspace(*QUIET_HZ, 41)
    before = float(np.sqrt(np.mean(chopper.unflipped_factor(band, CORNER_HZ) ** 2)))
    after = chopper.flipped_factor(float(np.mean(QUIET_HZ)), FLIP_HZ, CORNER_HZ)
    amplified, demodulated, filtered = (
        np.sqrt(_power_between(values, *QUIET_HZ)) / CHAIN.white_nt_per_rthz
        for values in (stages.amplified - stages.modulated, stages.demodulated, stages.filtered)
    )
    near, whole = (
        _power_between(stages.modulated, 180.0, 220.0) * (40.0 + RESOLUTION_HZ),
        float(np.mean(stages.modulated**2)),
    )
    example = "simulated, 60 s, corner 10 Hz, 200 Hz; closed form {:.3f}"
    noise = "noise at 10 to 30 Hz over the white one"
    return [
        _row(
            "fig. 3.13 c", "part of the signal at the flip rate", None, near / whole, "", example.format(8 / np.pi**2)
        ),
        _row("fig. 3.13 d", f"{noise}, before demodulation", None, float(amplified), "", example.format(before)),
        _row("fig. 3.13 e", f"{noise}, demodulated", None, float(demodulated), "", example.format(after)),
        _row("fig. 3.13 f", f"{noise}, behind the low pass", None, float(filtered), "", "as above, -3 dB at 30 Hz"),
    ]


def _brick_wall() -> list[Row]:
    why = "equal real poles; Butterworth filters would give 1.57, 1.11, 1.05, 1.03, 1.02"
    return [
        _row("table 3.1", f"K_n of {n} poles", printed, amplifier.brick_wall_factor(n), "", why if n == 2 else "")
        for n, printed in enumerate(BRICK_WALL, start=1)
    ]


def _resistors() -> float:
    """R5 to R8 in ohm that make the printed thermal noise: their values are not in the text."""
    return amplifier.resistance_of_thermal_nv(THERMAL / 2.0)


def _circuit(r1_ohm: float = 0.001) -> amplifier.Circuit:
    """Figure 3.17 with that, the gain of 60, and gain resistors that add nothing unless R1 is given."""
    r = _resistors()
    return amplifier.Circuit(BRIDGE_OHM, r1_ohm, 0.5 * (GAIN - 1.0) * r1_ohm, r, r, 2 * r, 2 * r)


def _table_3_2() -> list[Row]:
    part, r = Amplifier("OPA4377", OPA4377_NV, OPA4377_FA, 0.0), _resistors()
    found = amplifier.published(_circuit(), part)
    sum_printed = math.hypot(THERMAL, INPUT, CURRENT, U3, BUFFER)
    from_r = f"the resistors are not in the text; {r / 1e3:.1f} kΩ taken from this line (3.60, 300 K)"
    too_much = (
        f"√2 · {GAIN:g}/2 · √(7.5² + 4kT · 550 Ω) by 3.44-3.50 and 3.61, before any gain resistor: the printed value"
        f" is below that; it needs a gain of {GAIN * INPUT / found.input:.1f}"
    )
    needed_fa = CURRENT / math.sqrt(2.0) / r * 1e6
    no_current = (
        f"√2 · 2 fA · {r / 1e3:.1f} kΩ (3.62) is {found.current * 1e3:.0f} pV; the printed value needs"
        f" {needed_fa / 1e3:.2f} pA/√Hz, {needed_fa / OPA4377_FA:.0f} times the data sheet's 2 fA/√Hz"
    )
    row = partial(_row, "table 3.2")
    return [
        row("E_out-thermal", THERMAL, found.thermal, "nV/√Hz", from_r),
        row("E_out-input", INPUT, found.input, "nV/√Hz", too_much),
        row("E_out-current", CURRENT, found.current, "nV/√Hz", no_current),
        row("E_out-u3", U3, found.u3, "nV/√Hz", "as printed (3.63); U3 amplifies its own noise by 2, see below"),
        row("E_out-buffer", BUFFER, found.buffer, "nV/√Hz", "R9 ∥ R10 equal to R5"),
        row("E_out-total", TOTAL, sum_printed, "nV/√Hz", "3.64 with the printed lines"),
        row("E_total-rms", RMS, amplifier.total_rms_nv(TOTAL, CUTOFF_HZ), "nV", "3.65, 3.66 with the printed total"),
    ]


def _whole() -> list[Row]:
    part = Amplifier("OPA4377", OPA4377_NV, OPA4377_FA, 0.0)
    found = amplifier.whole(_circuit(), part)
    why = (
        f"each source followed to the output: 3.50 halves the first stage's gain. Printed, {TOTAL:g}/{GAIN:g} ="
        f" {TOTAL / GAIN:.1f} nV/√Hz at the input, less than the {part.input_nv:.1f} nV/√Hz of two amplifiers alone"
    )
    rows = [_row("table 3.2", "E_out-total of the circuit itself", TOTAL, found.total, "nV/√Hz", why)]
    for each in AMPLIFIERS:
        if not each.instrumentation:
            total = amplifier.whole(_circuit(), each).total
            rows.append(_row("fig. 3.20", f"output noise with {each.name}, gain 60", None, total, "nV/√Hz"))
    amp04 = find_amplifier("AMP04")
    half = BRIDGE_OHM / 2.0
    current = math.sqrt(2.0) * amplifier.current_nv(amp04.current_fa, half)
    total = GAIN * math.hypot(amp04.input_nv, current, amplifier.thermal_nv(BRIDGE_OHM))
    why = "45 nV and 4 pA/√Hz, not checked against a data sheet; measured, with supply and sensor, in the figure"
    return [*rows, _row("fig. 3.20", "output noise with AMP04, gain 60", None, total, "nV/√Hz", why)]


def _sensors() -> list[Row]:
    thermal = amplifier.thermal_nv(BRIDGE_OHM_HMC1001) / SENSITIVITY_HMC1001 * 1e3
    small = amplifier.thermal_nv(BRIDGE_OHM) / SENSITIVITY_HMC1021 * 1e3
    why = "measured in all: below 50 pT/√Hz at 10 to 100 Hz"
    return [
        _row("3.6", "thermal noise of the HMC1001 on 10 V", None, thermal, "pT/√Hz", why),
        _row("3.6", "thermal noise of the HMC1021 on 5 mA", None, small, "pT/√Hz"),
    ]


def _feedback() -> list[Row]:
    rows = [
        _row(
            "table 5.1",
            f"power of the {coil.name} at 1 G",
            printed,
            float(feedback.coil_power_mw(coil, ONE_GAUSS_UT)),
            "mW",
        )
        for coil, printed in COILS
    ]
    why = "table 5.1 takes the set/reset strap's resistance; the offset coil of our sensor file: {:g} Ω, {:.3g} mA/G"
    for coil in DATA_SHEET_COILS:
        remark = why.format(coil.resistance_ohm, coil.ma_per_ut * ONE_GAUSS_UT)
        power = float(feedback.coil_power_mw(coil, ONE_GAUSS_UT))
        rows.append(_row("table 5.1", f"power of the {coil.name} at 1 G, its offset coil", None, power, "mW", remark))
    fields = (ONE_GAUSS_UT, 3.0 * UT_PER_GAUSS, 8.0 * UT_PER_GAUSS)  # fig. 3.8
    bare = abs(float(reading_error_ut(*fields)))
    looped = abs(float(feedback.feedback_reading_ut(*fields, LOOP_GAIN)) - fields[0])
    example = "H_y = 1 G, H_x = 3 G, H_k = 8 G; loop gain 100"
    return [*rows, _row("5.1.1.2", "error without the loop over that with it", None, bare / looped, "", example)]
