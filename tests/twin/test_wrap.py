"""The ticks, which end at 2^30, begin anew while the board works: nothing that it says tells so."""

import time
from dataclasses import replace

import numpy as np
import pytest
from barberpole.board import load_board
from barberpole.driver_board import load_driver
from barberpole.nominal import nominal
from barberpole.records import RESULT, ROWS, decode
from barberpole.twin import Twin, World
from barberpole.twin.driven import CoilWorld
from barberpole_codegen.build import build
from barberpole_codegen.driver import build_driver

WRAPS_S = {"self-test": 0.02, "coil run": 0.9, "verdict": 1.72, "stream": 2.1}
END_S = 2.3
PERIOD = 1 << 30


@pytest.fixture(scope="module")
def said(tmp_path_factory):
    """said(board, build, world, wrap_s): the frames up to END_S, from a board that has never had power before."""

    def run(board, built, world, wrap_s):
        files = {f"/{to}": built.folder / source for source, to in built.files.items()}
        with Twin(board, tmp_path_factory.mktemp("flash"), world, seed=4, files=files, wrap_s=wrap_s) as twin:
            twin.wait_until(END_S + 0.1)
            twin.kill()
            frames = decode(twin.log_text.encode()).frames
        last = max(i for i, frame in enumerate(frames) if frame.type == ROWS and time_us(frame) < 1e6 * END_S)
        return [(frame.type, frame.payload) for frame in frames[: last + 1]], frames

    return run


def time_us(frame):
    return int.from_bytes(frame.payload[:8], "little")


@pytest.fixture(scope="module")
def sensor(said, tmp_path_factory):
    """What a sensor board says whose ticks wrap then."""
    board = load_board("pybv11")
    built = build(board, nominal(board), tmp_path_factory.mktemp("build"))
    return lambda wrap_s: said(board, built, World.of(board), wrap_s)


@pytest.fixture(scope="module")
def without(sensor):
    return sensor(0.0)


@pytest.mark.parametrize("moment", WRAPS_S)
def test_power_up_and_stream_are_the_same_to_the_byte(sensor, without, moment):
    plain, frames = without
    verdict = next(frame.json for frame in frames if frame.type == RESULT)
    assert verdict["accepted"]
    assert sensor(WRAPS_S[moment])[0] == plain
    times = np.array([int.from_bytes(payload[:8], "little") for kind, payload in plain if kind == ROWS])
    assert times[0] < 1e6 * WRAPS_S["stream"] < times[-1]
    assert np.all((np.diff(times) > 4_900) & (np.diff(times) < 10_100))


def test_coil_driver_says_the_same_to_the_byte(said, tmp_path):
    whole = load_driver("imcs_driver")
    driver = replace(whole, drive=replace(whole.drive, points=12))
    built = build_driver(driver, tmp_path)
    plain, wrapped = (said(driver, built, CoilWorld(), wrap_s)[0] for wrap_s in (0.0, 1.1))
    assert wrapped == plain
    assert sum(kind == ROWS for kind, _ in plain) > 5


PROGRAM = """
import time
before = time.ticks_us(), time.ticks_ms(), time.ticks_cpu()
time.sleep_ms(100)
print("ticks", *before, time.ticks_us(), time.ticks_ms(), time.ticks_cpu(), "end")
"""


def test_ticks_begin_anew_at_that_moment(board, tmp_path):
    (tmp_path / "main.py").write_text(PROGRAM)
    with Twin(board, tmp_path / "flash", files={"/main.py": tmp_path / "main.py"}, wrap_s=0.05) as twin:
        until = time.monotonic() + 20.0
        while "end" not in twin.log_text:
            assert time.monotonic() < until, twin.log_text
            time.sleep(0.02)
        values = [int(word) for word in twin.log_text.split("ticks ")[1].split()[:6]]
    assert all(PERIOD - 60 * rate < value < PERIOD for value, rate in zip(values, (1000, 1, 168_000), strict=False))
    assert all(0 < value < 60 * rate for value, rate in zip(values[3:], (1000, 1, 168_000), strict=True))
