"""MicroPython itself writes to the registers what CPython writes to their model, where the waveforms are proved.

The other tests of timers, converter and coils run the firmware in CPython on that model (tests/registers).
"""

import json
from pathlib import Path
from types import ModuleType

import pytest
from barberpole.board import load_board
from barberpole.mcu import load_pinout
from barberpole.nominal import nominal
from barberpole_codegen.modules import generate
from registers import Mcu, importable
from registers.addresses import GPIO, stm_names
from registers.modules import SRAM

SCRIPT = Path(__file__).parent / "on_board" / "write_registers.py"
TIMED = ("pybv11_timed", "nucleo_f446re")


class Spi:
    """A DAC80504 strapped as the board files ask; what is written goes to the journal."""

    journal: list

    def __init__(self, number, baudrate, polarity, phase):
        self._asked = b""

    def write_readinto(self, out, into):
        self.journal.append(["spi", list(out)])
        into[:] = {b"\x81": b"\x00\x04\x97", b"\x84": b"\x00\x00\x0f"}.get(self._asked, bytes(3))
        self._asked = bytes(out[:1])


def on_model(board, texts, rate_hz, codes):
    """The journal of CPython: registers but those of the ports, and pins as they were asked for."""
    generated = {}
    for file, text in texts.items():
        name = file.removesuffix(".py")
        generated[name] = ModuleType(name)
        exec(text, generated[name].__dict__)
    pinout = load_pinout(board.micropython_board)
    ports = [f"P{letter}{number}" for letter, count in pinout.ports.items() for number in range(count)]
    pins = {pinout.label(port): port for port in ports} | pinout.pins
    mcu = Mcu({"PC6": 1, "PC7": 2})
    journal = []

    def write(address, value, after=mcu.write):
        if not GPIO <= address < GPIO + 0x2000:
            journal.append([address, value])
        after(address, value)

    def pin(port, mode, level=None, af=0, after=mcu.pin):
        journal.append([port, mode, level, af])
        after(port, mode, level, af)

    mcu.write, mcu.pin = write, pin
    Spi.journal = journal
    with importable(mcu, pins, generated, Spi):
        hardware = __import__("bp_hardware").Hardware()
        hardware.start()
        hardware.dac.start(getattr(generated["bp_board"], "DAC_GAIN", 0))
        hardware.coils.set(codes)
        hardware.sampler.retime(rate_hz)
        hardware.off()
    return journal, pins


@pytest.mark.parametrize("name", TIMED)
def test_micropython_writes_what_the_model_was_given(name, micropython, tmp_path):
    board = load_board(name)
    made = generate(board, nominal(board))
    codes = [(1 << board.dac.bits - 1) + off for off in (1, -2, 3)]
    journal, pins = on_model(board, made.texts, board.flip.rate_hz, codes)
    for file, text in made.texts.items():
        (tmp_path / file).write_text(text)
    setup = {"names": stm_names(), "ring": SRAM, "codes": codes, "rate_hz": board.flip.rate_hz}
    setup["spi_dac"] = board.dac.part != "stm32f4_dac"
    (tmp_path / "stm.json").write_text(json.dumps(setup))
    on_board = json.loads(micropython(SCRIPT, tmp_path, cwd=tmp_path))
    named = [[pins[entry[0]], *entry[1:]] if entry[0] in pins else entry for entry in on_board]
    assert len(journal) > 150
    assert named == journal
