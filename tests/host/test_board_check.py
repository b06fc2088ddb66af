"""`barberpole board check`: every conflict of a board file explained, not only the first."""

import json
import re

import pytest
from barberpole import paths
from barberpole.cli import run
from barberpole.mcu import load_mcu, load_pinout, pinouts

BOARDS = ("pybv11", "pybv11_timed", "nucleo_f446re", "stm32f4disc")


@pytest.mark.parametrize("name", BOARDS)
def test_shipped_boards_have_no_conflict(capsys, name):
    assert run(["board", "check", name, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["passed"]
    assert found["conflicts"] == []
    ports = [pin["port"] for pin in found["pins"]]
    assert len(set(ports)) == len(ports) >= 7


def test_all_conflicts_are_explained(capsys, tmp_path):
    text = (paths.boards() / "pybv11.toml").read_text()
    for old, new in (('cs_pin = "X5"', 'cs_pin = "Y1"'), ('cs_pin = "Y5"', 'cs_pin = "Q99"'), ("pga = 16", "pga = 64")):
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "mine.toml"
    path.write_text(text)
    assert run(["board", "check", str(path), "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    said = "\n".join(found["conflicts"])
    assert "adc.cs_pin must be a pin of its own; got Y1 = PC6, which is also flip.set_pin (SET pulse)" in said
    assert "dac.cs_pin must be a pin of the PYBV11; got 'Q99'" in said
    assert "the bridge signal must be at most 18.75 mV" in said
    assert len(found["conflicts"]) == 3
    assert run(["board", "check", str(path)]) == 1
    assert re.search(r"conflict: dac\.cs_pin must be a pin of the\s+PYBV11", capsys.readouterr().out)


def test_a_file_that_is_no_board_is_bad_input(capsys, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("[board]\n")
    assert run(["board", "check", str(path)]) == 2
    assert "board.sensor" in capsys.readouterr().err


@pytest.mark.parametrize("name", pinouts())
def test_a_boards_buses_are_in_the_table_of_its_microcontroller(name):
    """MicroPython's own bus pins against the data sheet's alternate functions: two sources, one wiring."""
    pinout = load_pinout(name)
    for number, lines in pinout.spi.items():
        for line, port in lines.items():
            assert port in pinout.mcu.alternate[f"SPI{number}_{line.upper()}"]
    for port in [*pinout.pins.values(), *pinout.taken]:
        assert int(port[2:]) < pinout.ports[port[1]]


def test_alternate_functions_have_the_numbers_of_their_group():
    """On every STM32F4 a function group has one column: TIM1/2 AF1, TIM3/4/5 AF2, TIM8 AF3, SPI1/2 AF5, SPI3 AF6."""
    column = {"TIM1": 1, "TIM2": 1, "TIM3": 2, "TIM4": 2, "TIM5": 2, "TIM8": 3, "SPI1": 5, "SPI2": 5, "SPI3": 6}
    second = {"SPI2_MOSI": {"PC1": 7}, "SPI3_MOSI": {"PB0": 7, "PB2": 7, "PC1": 5}}  # STM32F446 only
    for name in ("stm32f405", "stm32f407", "stm32f446"):
        for function, pins in load_mcu(name).alternate.items():
            for pin, number in pins.items():
                assert number == second.get(function, {}).get(pin, column[function[:4]]), (name, function, pin)
    assert set(load_mcu("stm32f405").alternate["TIM1_CH1"]) < set(load_mcu("stm32f407").alternate["TIM1_CH1"])
    assert "PC1" not in load_mcu("stm32f405").alternate["SPI2_MOSI"]


def test_boards_lists_every_file_by_the_name_that_commands_take(capsys):
    assert run(["boards", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert {row["name"] for row in said["boards"] if row["role"] == "sensor"} == set(BOARDS)
    assert {row["role"] for row in said["boards"]} == {"sensor", "array", "coil driver"}
    assert said["sensors"] == sorted(path.stem for path in (paths.boards() / "sensors").glob("*.toml"))
    assert all(row["mcu"].startswith("STM32F4") and row["adc"] for row in said["boards"])
    assert run(["boards"]) == 0
    assert str(paths.boards()) in capsys.readouterr().out
