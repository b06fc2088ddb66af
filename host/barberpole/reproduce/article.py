"""The article's figures that follow from its own inputs, and simulations of its methods on its own table 1."""

from functools import partial

import numpy as np

from barberpole.board import load_sensor
from barberpole.characterise.angles import noise_angle_deg
from barberpole.characterise.response import bandwidth_hz, first_order, response
from barberpole.characterise.simulate import noise, sensitivity_nt, white_and_corner
from barberpole.characterise.sine import fit_histogram, fit_sine
from barberpole.characterise.temperature import thermometer
from barberpole.methods.linear import decompose, linear_model
from barberpole.methods.polynomial import choose, polynomial_model
from barberpole.methods.turn_over import turn_over
from barberpole.reproduce.row import Row
from barberpole.sensor import Digital
from barberpole.trajectory.programs import FREQUENCIES_HZ, SINE_PEAK_TO_PEAK_UT, lin_60000

_row = partial(Row, "article")

KINDS = ("lsm303dlhc", "hmc5983", "lis3mdl")
ANGLES_DEG = {30_000.0: (0.38, 0.15, 1.51), 16_000.0: (0.72, 0.29, 2.85)}  # table 1, by B in nT
MORE_THAN = 2.0  # 3.4: the second column "more than twice as big"
AXES_DEG, MISALIGNED_DEG = 82.5, 7.5  # 3.4, y-z of the HMC5983
DRIFT_25C = (-15.3, -5.6, 2.6)  # table 1, middle of the range at 25 °C
DRIFT_SPAN_PT = (-150.0, 100.0)  # 3.1
COLD_PERCENT, COLD_ERROR_NT = 1.0, 300.0  # 3.1, of 30 000 nT
OPERATING_C = (-40.0, 85.0)  # 3.1
OFFSET_DRIFT_MAX = (29.5, 56.8, 598.6)  # table 1
LARGEST_OFFSET_NT = 53_700.0  # 3.2
THEMIS_RELATIVE, THEMIS_HZ = 0.70, 60.0  # 3.1
RELATIVE_AT_61_HZ, FASTEST_HZ = (0.90, 0.97), 61.0  # 3.1
ON_AXIS_PERCENT = 80.0  # 3.1, fig. 5: "up to"
C_PER_LSB = 0.125  # of the LIS3MDL, data sheet: 8 LSB/K
TURN_RESIDUAL_NT = 2.5  # 2.4
SECONDS = 300


def rows() -> list[Row]:
    """All of them, in the order of the article."""
    sensors = {name: _digital(name) for name in KINDS}
    return [
        *_linear(), *_turn_over(), _thermometer(), *_amplitude(), *_polynomial(), *_bandwidth(), _relative(),
        *_drift(sensors), *_cold(sensors), *_offset(sensors), *_noise(sensors), *_angles(sensors),
    ]  # fmt: skip


def _digital(name: str) -> Digital:
    digital = load_sensor(name).digital
    if digital is None:
        raise LookupError(f"{name} has no table [sensor.digital]")
    return digital


def _linear() -> list[Row]:
    """Eq. 1-3: nine parameters of M = R W S from LIN-60000 under the printed noise of the HMC5983."""
    rng, digital = np.random.default_rng(7), _digital("hmc5983")
    step = 1e-3 * np.array(digital.sensitivity_nt_per_lsb)
    about, yz = np.radians(20.0), np.radians(MISALIGNED_DEG)
    turn = np.array([[np.cos(about), -np.sin(about), 0], [np.sin(about), np.cos(about), 0], [0, 0, 1]])
    true = turn @ np.array([[1, 0, 0], [0, 1, -np.sin(yz)], [0, 0, np.cos(yz)]]) * step
    field = np.repeat(lin_60000().field_ut, round(25.0 * digital.rate_hz), axis=0).T
    y = np.linalg.solve(true, field) + 1e-3 * noise(digital, field.shape[1], rng) / step[:, None]
    parts = decompose(linear_model(y, field).matrix)
    how = "simulated: LIN-60000 under the printed noise, with the printed sensitivity and misalignment"
    angle, what = float(parts.angle_deg[2]), "sensitivity by the linear model"
    return [
        *(_row("eq. 1-3", f"{what}, {axis}", float(1000 * s), float(1000 * f), "nT/LSB", how)
          for axis, s, f in zip("xyz", step, parts.sensitivity, strict=True)),
        _row("eq. 3, 3.4", "misalignment y-z by the linear model", MISALIGNED_DEG, angle, "°", how),
    ]  # fmt: skip


def _thermometer() -> Row:
    """Fig. 4: a chip's thermometer of whole counts against the box while it cools from 70 °C."""
    temp = 25.0 + 45.0 * np.exp(-np.linspace(0.0, 3.0, 400))
    counts = np.round((temp - 25.0) / C_PER_LSB)
    found = thermometer(counts, temp)
    remark = f"simulated: counts of {C_PER_LSB:g} K, cooling from 70 °C; left over {1000 * found.rms_c:.0f} mK rms"
    return _row("fig. 4", "temperature per count of the internal sensor", None, found.c_per_lsb, "K/LSB", remark)


def _relative() -> Row:
    """Fig. 6: five sensors of three axes, bandwidths between those that 90 and 97 % at 61 Hz stand for."""
    low, high = (bandwidth_hz(FASTEST_HZ, r) for r in RELATIVE_AT_61_HZ)
    bands = np.linspace(low, high, 15)
    found = response(FREQUENCIES_HZ, np.array([first_order(np.array(FREQUENCIES_HZ), b) for b in bands]))
    remark = f"± {found.stderr[-1]:.3f} over fifteen axes, first order; published: the middle of the printed 90 to 97 %"
    middle = 0.5 * sum(RELATIVE_AT_61_HZ)
    return _row("fig. 6", "mean relative amplitude at 61 Hz", middle, float(found.relative[-1]), "", remark)


def _turn_over() -> list[Row]:
    """2.4: offset and residual field of a simulated HMC5983 in the residual field of the coils."""
    rng, digital = np.random.default_rng(1), _digital("hmc5983")
    turn = np.repeat(np.arange(4.0), 4000)
    sign = np.array([[1, 1, -1, -1], [1, -1, 1, -1], [1, -1, -1, 1]])[:, turn.astype(int)]
    y = TURN_RESIDUAL_NT * sign + noise(digital, turn.size, rng)
    found = turn_over(y, turn)
    apart = float(np.max(np.abs(found.residual - TURN_RESIDUAL_NT)))
    remark = (
        f"simulated: four positions of {turn.size / 4 / digital.rate_hz:.0f} s each in a residual field of "
        f"{TURN_RESIDUAL_NT:g} nT. The printed 1/f noise hides so small a field from this sensor itself"
    )
    return [_row("2.4", "residual field by turn-over, largest error", None, apart, "nT", remark)]


def _amplitude() -> list[Row]:
    """Eq. 8-9, fig. 3: the sine of 4000 nT peak to peak at 1 Hz under the LSM303DLHC's noise and steps."""
    rng, digital = np.random.default_rng(2), _digital("lsm303dlhc")
    t = np.arange(SECONDS * digital.rate_hz) / digital.rate_hz
    step, true = digital.sensitivity_nt_per_lsb[0], 500.0 * SINE_PEAK_TO_PEAK_UT
    out = []
    for f in (1.0, 61.0):
        y = true * np.sin(2 * np.pi * 1.0003 * f * t) + noise(digital, t.size, rng)[0]
        counts = np.round(y / step)
        by_histogram = step * fit_histogram(counts, digital.noise_nt[0] / step).amplitude
        by_sine = step * fit_sine(t, counts, f).amplitude
        name = f"amplitude at {f:g} Hz of the applied 2000 nT"
        out += [
            _row("eq. 8-9, fig. 3", f"{name}, by the histogram", true, by_histogram, "nT", "simulated"),
            _row("fig. 3", f"{name}, by the sine", true, by_sine, "nT", "simulated"),
        ]
    return out


def _polynomial() -> list[Row]:
    """3.1, fig. 5: a cubic that leaves a linear residual of some hundred nT at 60 µT, through LIN-60000."""
    rng, digital = np.random.default_rng(3), _digital("lsm303dlhc")
    field = np.repeat(lin_60000().field_ut, 25, axis=0).T
    step = 1e-3 * np.array(digital.sensitivity_nt_per_lsb)[:, None]
    reached = field - 6e-6 * field**3
    held = np.sqrt(25.0 * digital.rate_hz / 25.0)  # each row stands for 1 s of the 25 s of a level
    y = (reached + 1e-3 * noise(digital, field.shape[1], rng) / held) / step
    degrees, _ = choose(y, field, most=4)
    before, after = linear_model(y, field).field(y) - field, polynomial_model(y, field, (3, 2)).field(y) - field
    fall = 100.0 * (1.0 - float(np.sqrt(np.mean(after**2) / np.mean(before**2))))
    remark = (
        f"simulated: 6e-6/µT² of cubic under the printed noise; {fall:.0f} % off. Held-out error chooses "
        f"m = {degrees[0]}, n = {degrees[1]}"
    )
    return [_row("fig. 5", "fall of the residual, polynomial against linear, is 80 % or more", 1.0,
                 float(fall >= ON_AXIS_PERCENT), "", remark)]  # fmt: skip


def _bandwidth() -> list[Row]:
    low, high = (bandwidth_hz(FASTEST_HZ, r) for r in RELATIVE_AT_61_HZ)
    return [
        _row("3.1", "relative amplitude at 60 Hz of a first-order bandwidth of 60 Hz", THEMIS_RELATIVE,
             float(first_order(THEMIS_HZ, THEMIS_HZ))),
        _row("3.1", "3 dB bandwidth for 90 % at 61 Hz", None, low, "Hz", "first order: well above 61 Hz, as stated"),
        _row("3.1", "3 dB bandwidth for 97 % at 61 Hz", None, high, "Hz", "first order"),
    ]  # fmt: skip


def _drift(sensors: dict[str, Digital]) -> list[Row]:
    """Table 1: the mean formula at 25 °C against the middle of the range there, and over the operating range."""
    out = []
    for (name, digital), printed in zip(sensors.items(), DRIFT_25C, strict=True):
        slope, level = digital.sensitivity_drift_formula
        terms = f"{slope:g} x 25 {level:+g}: a mean over sensors"
        remark = f"{terms}, where table 1's other line prints the middle of a range, ± {_half(digital):g}"
        out.append(_row("table 1", f"drift at 25 °C by the formula, {name}", printed, 25 * slope + level,
                        "pT/LSB/K", remark))  # fmt: skip
    formulas = [digital.sensitivity_drift_formula for digital in sensors.values()]
    lowest = min(slope * OPERATING_C[0] + level for slope, level in formulas)
    highest = max(slope * OPERATING_C[1] + level for slope, level in formulas)
    remark = "printed {:g} over single sensors and axes; the mean formula, which is all that is printed, lies inside"
    return [
        *out,
        _row("3.1", "lowest drift, at -40 °C", None, lowest, "pT/LSB/K", remark.format(DRIFT_SPAN_PT[0])),
        _row("3.1", "highest drift, at 85 °C", None, highest, "pT/LSB/K", remark.format(DRIFT_SPAN_PT[1])),
    ]


def _half(digital: Digital) -> float:
    return digital.sensitivity_drift_25c_pt_per_lsb_per_c[1]


def _cold(sensors: dict[str, Digital]) -> list[Row]:
    """3.1: what the drift formula makes of the sensitivity between 25 and -40 °C."""
    out = []
    for name in ("lsm303dlhc", "hmc5983"):
        digital = sensors[name]
        cold, warm = (sensitivity_nt(digital, t)[0] for t in (OPERATING_C[0], 25.0))
        percent = 100.0 * (cold / warm - 1.0)
        slope, level = digital.sensitivity_drift_formula
        remark = (
            f"the integral of {slope:g} T {level:+g} from 25 to -40 °C is {cold - warm:.2f} nT/LSB of {warm:g}: the "
            "formula and the stated 1 % do not belong to the same range; measured was 25 to 70 °C (2.4)"
        )
        out.append(_row("3.1", f"change of sensitivity in the cold, {name}", COLD_PERCENT, percent, "%", remark))
    error = COLD_PERCENT / 100.0 * 30_000.0
    return [*out, _row("3.1", "error of 1 % in 30 000 nT", COLD_ERROR_NT, error, "nT")]


def _offset(sensors: dict[str, Digital]) -> list[Row]:
    largest = max(abs(v) for digital in sensors.values() for v in digital.offset_nt)
    out = [_row("3.2", "largest offset", LARGEST_OFFSET_NT, largest, "nT")]
    for (name, digital), printed in zip(sensors.items(), OFFSET_DRIFT_MAX, strict=True):
        middle, half = digital.offset_drift_nt_per_c
        out.append(_row("table 1", f"largest offset drift, {name}", printed, abs(middle) + half, "nT/K"))
    return out


def _noise(sensors: dict[str, Digital]) -> list[Row]:
    """Table 1, fig. 8: density at 1 Hz if the noise were white, against the printed one."""
    out = []
    for name, digital in sensors.items():
        for case, i in (("x/y", 0), ("z", 2)):
            std, printed = digital.noise_nt[i], digital.noise_at_1_hz_nt_per_rthz[i]
            white, corner = white_and_corner(std, printed, digital.rate_hz)
            flat = std / np.sqrt(0.5 * digital.rate_hz)
            remark = f"σ / √({0.5 * digital.rate_hz:g} Hz), for white noise"
            if corner:
                remark += f"; printed {printed:g}: both figures fit {white:.3g} nT/√Hz with a corner at {corner:.2g} Hz"
            else:
                remark += "; the printed density comes from a spectrum's few lines at 1 Hz, the σ from all"
            shown = None if corner else printed
            out.append(_row("table 1", f"density at 1 Hz from σ, {name} {case}", shown, flat, "nT/√Hz", remark))
    return out


def _angles(sensors: dict[str, Digital]) -> list[Row]:
    """Eq. 13 and table 1; the misalignment of the HMC5983."""
    out = []
    for field, printed in ANGLES_DEG.items():
        for (name, digital), angle in zip(sensors.items(), printed, strict=True):
            ours = noise_angle_deg(digital.noise_nt[0], digital.noise_nt[2], field)
            remark = "printed to two decimals" if abs(ours - angle) > 0.02 * angle else ""
            out.append(_row("eq. 13", f"ξ_max at {field:.0f} nT, {name}", angle, ours, "°", remark))
    digital = sensors["lsm303dlhc"]
    low, high = (noise_angle_deg(digital.noise_nt[0], digital.noise_nt[2], field) for field in (16_000.0, 30_000.0))
    remark = "30 000 / 16 000 = 1.875 for small angles: nearly, not more than, twice"
    return [
        *out,
        _row("3.4", "ξ_max at 16 000 nT over that at 30 000 nT", MORE_THAN, low / high, "", remark),
        _row("3.4", "misalignment of axes at 82.5°", MISALIGNED_DEG, 90.0 - AXES_DEG, "°"),
    ]
