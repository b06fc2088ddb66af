"""Board files: the shipped ones are consistent, and each thing a board cannot do is refused with figures."""

import math
import re
from dataclasses import replace
from pathlib import Path

import pytest
from barberpole import paths
from barberpole.board import load_board, load_sensor
from barberpole.errors import BarberpoleError, InputError, LimitError
from barberpole.strap import strap_decay, strap_mean_a, strap_ohm, strap_peak_a, strap_power_mw
from barberpole.wiring import conflicts

TEXT = (paths.boards() / "pybv11.toml").read_text()


def edited(key: str, line: str, text: str = TEXT) -> str:
    """The board file with the line of `table.key` replaced; a bare key in brackets is a table's own line."""
    table, _, name = key.rpartition(".")
    before, mark, after = text.rpartition(f"[{table}]\n") if table else ("", "", text)
    old = f"\\[{name}\\]" if not table else f"{name} = "
    changed, count = re.subn(rf"^{old}.*$", line, after, count=1, flags=re.M)
    assert count == 1, key
    return before + mark + changed


def refuse(tmp_path: Path, text: str) -> BarberpoleError:
    """The error of a board file with this text."""
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(BarberpoleError) as caught:
        load_board(path)
    assert "\n" not in str(caught.value)
    return caught.value


def test_pybv11_by_name_and_by_path():
    assert load_board("pybv11") == load_board(paths.boards() / "pybv11.toml")


@pytest.mark.parametrize("name", [path.stem for path in paths.boards().glob("*.toml")])
def test_shipped_board_passes_its_checks(name):
    assert load_board(name).name == name


@pytest.mark.parametrize("name", ["../../elsewhere", "a\\nimport os", "", "a b", "x" * 65, "µ"])
def test_a_name_is_no_path_and_no_program(tmp_path, name):
    """It becomes part of file names and of the text of generated modules."""
    said = str(refuse(tmp_path, TEXT.replace('name = "pybv11"', f'name = "{name}"')))
    assert said.startswith("board.name must be a name of at most 64 letters (a-z), digits, _, ., + or -; got ")


@pytest.mark.parametrize("name", [path.stem for path in (paths.boards() / "sensors").glob("*.toml")])
def test_shipped_sensor(name):
    sensor = load_sensor(name)
    assert sensor.name == name
    assert sensor.easy_axis_index == (1, 0, 1)  # thesis 5.3.2
    assert all(sensor.axes[sensor.easy_axis_index[i]] != axis for i, axis in enumerate(sensor.axes))


def test_offset_coil_of_thesis_6_2_is_the_data_sheets():
    # 4.6 mA/G (data sheet) and 21.7 mT/A (thesis 6.2.1) are one figure; table 5.1 says 5 mA/G
    sensor = load_sensor("hmc1021_1022")
    assert sensor.offset_coil_ut_per_ma == pytest.approx(100.0 / 4.6, rel=2e-3)
    assert sensor.offset_coil_ut_per_ma != pytest.approx(100.0 / 5.0, rel=2e-2)


def test_sensitivity_two_ways():
    # 3.2 mV/V/G (thesis 3.6) on 5 V is 160 V/T (thesis 5.3.1)
    sensor = load_sensor("hmc1001_1002")
    volt_per_tesla = sensor.sensitivity_mv_per_v_per_ut * 1e-3 * 1e6 * 5.0
    assert volt_per_tesla == pytest.approx(160.0)
    assert sensor.bridge_v == pytest.approx(5.0, rel=1e-3)


@pytest.mark.parametrize(("name", "resolution_nt"), [("hmc1021_1022", 8.0), ("hmc1001_1002", 2.7)])
def test_noise_density_gives_the_resolution(name, resolution_nt):
    # rms of n² (1 + corner/f) over 0.1 to 10 Hz, 6.6 standard deviations peak to peak
    sensor = load_sensor(name)
    variance = sensor.noise_nt_per_rthz**2 * (9.9 + sensor.corner_hz * math.log(100.0))
    assert 6.6 * math.sqrt(variance) == pytest.approx(resolution_nt, rel=0.03)


def test_noise_density_is_thermal_noise_and_an_amplifier():
    sensor = load_sensor("hmc1021_1022")
    thermal_nv = 1e9 * math.sqrt(4 * 1.380649e-23 * 298.0 * sensor.bridge_ohm)  # thesis 3.44
    nv_per_nt = sensor.sensitivity_mv_per_v_per_ut * sensor.bridge_v * 1e3
    assert math.hypot(thermal_nv, 7.5) / nv_per_nt == pytest.approx(sensor.noise_nt_per_rthz, rel=0.03)


def test_strap_power_is_the_thesis_at_one_kilohertz():
    board = load_board("pybv11")
    thesis = replace(board, flip=replace(board.flip, strap_supply_v=12.0, capacitor_nf=220.0, rate_hz=1000.0))
    assert strap_power_mw(thesis) == pytest.approx(32.0, rel=0.02)  # thesis 3.4.3
    assert strap_peak_a(board) >= board.sensor.strap_current_a


def test_strap_current_two_ways():
    """The capacitor charged to and fro until nothing changes, against the closed forms."""
    board = load_board("pybv11")
    ohm, farad = strap_ohm(board), board.flip.capacitor_nf * 1e-9
    volt, step = 0.0, 1e-9
    for half in range(20):
        target, coulomb = board.flip.strap_supply_v * (half % 2), 0.0
        peak = (target - volt) / ohm
        for _ in range(round(board.flip.pulse_us * 1e-6 / step)):
            current = (target - volt) / ohm
            coulomb += current * step
            volt += current * step / farad
    assert abs(peak) == pytest.approx(strap_peak_a(board), rel=1e-3)
    assert current / peak == pytest.approx(strap_decay(board), rel=2e-3)
    assert abs(coulomb) / (board.flip.pulse_us * 1e-6) == pytest.approx(strap_mean_a(board), rel=1e-3)
    assert 0.95 * abs(peak) > board.sensor.strap_current_a  # at the lowest supply that the firmware accepts


def test_scale_from_the_parts():
    board = load_board("pybv11")
    volt_per_ut = 1e-3 * board.sensor.sensitivity_mv_per_v_per_ut * 5.5
    lsb_volt = 2.0 * 1.2 / 16 / 2**24  # the converter's span at gain 16 over its codes
    assert board.scale_lsb_per_ut == pytest.approx(volt_per_ut / lsb_volt)


def test_power_up_run_fits_into_two_seconds():
    board = load_board("pybv11")
    run = board.selfcal
    cycles = run.points * (run.settle_cycles + run.cycles_per_point)
    assert cycles / board.flip.rate_hz + run.points * board.timing.python_us_per_selfcal_point * 1e-6 < 2.0


@pytest.mark.parametrize(
    ("key", "line", "says"),
    [
        ("flip.pulse_us", "pulse_us = 8\npulse_width = 8", "flip.pulse_width"),
        ("flip.pulse_us", "pulse_ms = 0.008", "closest: flip.pulse_us"),
        ("flip", "[flop]", "closest: flip"),
        ("board.shielded", "shielded = false\nshield = true", "closest: board.shielded"),
        ("adc.channels.supply", "suply = 7", "closest: adc.channels.supply"),
        ("flip.rate_hz", "", "flip.rate_hz must be given (Hz."),
        ("flip.pulse_us", "pulse_us = '8'", "flip.pulse_us must be a valid number; got '8'"),
        ("coils.max_ma", "max_ma = nan", "finite"),
        ("coils.max_ma", "max_ma = -1.0", "coils.max_ma must be greater than 0"),
        ("coils.full_scale_ma", "full_scale_ma = [5.0, 5.0]", "coils.full_scale_ma[2] must be given"),
        ("selfcal.points", "points = 127", "multiple of 2"),
        ("selfcal.radii_ut", "radii_ut = []", "at least 1 item"),
        ("dac.part", 'part = "ad5628"', "dac.part"),
        ("board.shielded", "shielded = 0", "board.shielded"),
        ("board.sensor", "", "board.sensor"),
        ("board.sensor", 'sensor = "nowhere.toml"', "the sensor file must be a file that can be read"),
        ("dac.cs_pin", 'cs_pin = "Y1"', "Y1 = PC6, which is also flip.set_pin"),
        ("adc.channels.supply", "supply = 6", "6, which is also adc.channels.coil_z"),
        ("adc.channels.supply", "supply = 8", "at most 7 on the ads131m08"),
        ("adc.bits", "bits = 16", "24, those of the ads131m08"),
        ("adc.spi", "spi = 9", "one of the buses of a PYBV11 (1, 2)"),
        ("dac.cs_pin", 'cs_pin = "Q99"', "dac.cs_pin must be a pin of the PYBV11; got 'Q99'"),
        ("adc.sck_pin", 'sck_pin = "Y6"', "X6 (PA5), which is sck of SPI 1; got Y6, which is SPI2_SCK"),
        ("adc.cs_pin", 'cs_pin = "X8"', "X8 = PA7, which is also adc.cs_pin"),
        ("adc.cs_pin", 'cs_pin = "X17"', "X17 = PB3, which is the user switch"),
        ("adc.drdy_pin", "", "adc.drdy_pin must be given for the ads131m08"),
        ("flip.timing", 'timing = "hardware"', '"software" with a converter on SPI'),
        ("board.mcu", 'mcu = "STM32F446RE"', "the STM32F405 of a PYBV11"),
        ("board.micropython_board", 'micropython_board = "PYBV9"', "one of NUCLEO_F446RE, PYBV11, STM32F4DISC"),
        ("flip.rate_hz", "rate_hz = = 200", "valid TOML; got Invalid value (at line 23"),
    ],
)
def test_wrong_file_is_refused(tmp_path, key, line, says):
    error = refuse(tmp_path, edited(key, line))
    assert isinstance(error, InputError)
    assert says in str(error)
    assert str(tmp_path) in str(error)


@pytest.mark.parametrize(
    ("key", "line", "says"),
    [
        ("flip.pulse_us", "pulse_us = 3", "flip.pulse_us must be at least 5 µs"),
        ("flip.rate_hz", "rate_hz = 400", "half cycle's work must be at most 1250 µs"),
        ("flip.settle_us", "settle_us = 2000", "half cycle"),
        ("flip.strap_supply_v", "strap_supply_v = 9.0", "at least 0.5 A"),
        ("flip.strap_supply_v", "strap_supply_v = 12.0", "got 0.407"),
        ("flip.strap_supply_v", "strap_supply_v = 50.0", "power of flipping"),
        ("flip.capacitor_nf", "capacitor_nf = 4700.0", "93% of a pulse's current is left"),
        ("adc.common_mode_v", "common_mode_v = 2.75", "feed the bridges symmetrically"),
        ("coils.max_ma", "max_ma = 3.0", "coils.max_ma; a radius of 80 µT takes it"),
        ("coils.max_ma", "max_ma = 5.5", "the DAC reaches no further"),
        ("coils.max_ma", "max_ma = 25.0", "the offset coil bears no more"),
        ("coils.series_ohm", "series_ohm = 250.0", "6.25 mA, the DAC's ±2.5 V over 400 Ω"),
        ("dac.vref_v", "vref_v = 1.25", "the DAC's ±1.25 V"),
        ("adc.pga", "pga = 64", "the bridge signal must be at most 18.75 mV"),
        ("adc.bridge_divider", "bridge_divider = 0.3", "bridge voltage"),
        ("adc.supply_divider", "supply_divider = 0.5", "strap supply"),
        ("selfcal.radii_ut", "radii_ut = [40.0, 700.0]", "range of the sensor"),
        ("selfcal.radii_ut", "radii_ut = [40.0, 100.0]", "coil current of the self-calibration"),
    ],
)
def test_limit_is_refused(tmp_path, key, line, says):
    error = refuse(tmp_path, edited(key, line))
    assert isinstance(error, LimitError)
    assert says in str(error)
    assert str(tmp_path) in str(error)


TIMED = (paths.boards() / "pybv11_timed.toml").read_text()
NUCLEO = (paths.boards() / "nucleo_f446re.toml").read_text()


@pytest.mark.parametrize(
    ("text", "key", "line", "says"),
    [
        (TIMED, "flip.set_pin", 'set_pin = "X10"', "a channel of TIM8 (C8, C9, Y1, Y2)"),
        (TIMED, "flip.break_pin", 'break_pin = "X8"', "the break input of TIM8 (X7)"),
        (TIMED, "flip.timing", 'timing = "software"', '"hardware" with the stm32f4_adc'),
        (TIMED, "dac.pwm_pin", 'pwm_pin = "Y9"', "an output of a timer other than TIM8, TIM2, TIM5, TIM6"),
        (TIMED, "adc.ring_cycles", "ring_cycles = 8", "adc.ring_cycles must be at least 20"),
        (TIMED, "adc.ring_cycles", "ring_cycles = 200", "a quarter of board.ram_kib"),
        (TIMED, "adc.sample_hz", "sample_hz = 64000", "a scan of 8 inputs takes 15.2 µs"),
        (TIMED, "board.cpu_mhz", "cpu_mhz = 320", "at most 36 MHz"),
        (TIMED, "adc.channels.x", "x = 4", "X5 = PA4, which is also adc.channels.x (ADC1 input 4)"),
        (TIMED, "adc.channels.x", "x = 16", "an input of ADC1 that has a pin"),
        (TIMED, "coils.settle_us", "settle_us = 6000", "selfcal.settle_cycles of 1000 Hz"),
        (NUCLEO, "dac.cs_pin", 'cs_pin = "D1"', "the prompt's serial line to the ST-LINK"),
    ],
)
def test_what_timed_boards_cannot_do_is_refused(tmp_path, text, key, line, says):
    text = re.sub(r"^(sck|miso|mosi)_pin.*\n", "", text, flags=re.M)
    assert says in str(refuse(tmp_path, edited(key, line, text)))


def test_a_bus_on_the_controller_of_the_samples_is_refused():
    board = load_board("nucleo_f446re")
    found = conflicts(replace(board, dac=replace(board.dac, spi=1)))
    assert any("MicroPython stops DMA2 64 ms after its own last use" in text for text in found)
    assert any("the green LED" in text for text in found)
    assert conflicts(board) == []


def test_slow_coils_need_settle_cycles(tmp_path):
    slow = edited("coils.settle_us", "settle_us = 900", edited("selfcal.settle_cycles", "settle_cycles = 0"))
    assert "coils.settle_us must be at most 500 µs" in str(refuse(tmp_path, slow))


def test_sensor_beside_the_board_and_wrong_for_it(tmp_path):
    sensor = (paths.boards() / "sensors" / "hmc1001_1002.toml").read_text()
    (tmp_path / "sensor.toml").write_text(sensor)
    error = refuse(tmp_path, edited("board.sensor", 'sensor = "sensor.toml"'))
    assert "three straps of 1.5 Ω" in str(error)  # 3 A are more than 12 V can drive through them


def test_unknown_names_say_the_known_ones():
    with pytest.raises(InputError, match="closest: pybv11"):
        load_board("pybv1")
    with pytest.raises(InputError, match="hmc1021_1022"):
        load_sensor("bmm150")
