"""The streamed row in fixed point: as the generator proves it, as MicroPython runs it, and beside the float version."""

import ast
import json
from dataclasses import replace

import numpy as np
import pytest
from barberpole import paths
from barberpole.errors import InputError, LimitError
from barberpole.fitted import from_calibration
from barberpole.mpy import compile_module
from barberpole.records import decode
from barberpole_codegen import build, hot, rows, settings
from barberpole_codegen.fixed import BITS, execute
from barberpole_codegen.functions import GAINS, SUMS, trace_row
from barberpole_codegen.modules import generate
from barberpole_codegen.narrow import evaluate, narrow

GAIN = (1.03, 0.96, 1.01)
OFFSET_LSB = (5000.0, -31000.3, 123.4)
TEMPS_C = (0.0, 50.0)
ROWS = 400


@pytest.fixture(scope="module")
def fitted(calibration):
    return from_calibration(calibration)


@pytest.fixture(scope="module")
def row(fitted, board):
    return hot.hot_row(fitted, board, TEMPS_C)


def inside(row, n, seed=5):
    """Input registers anywhere in the box, a third of them at its faces."""
    rng = np.random.default_rng(seed)
    given = {}
    for name, placed in row.program.inputs.items():
        low, high = hot._limits(placed)
        at_faces = np.where(rng.random(n) < 0.5, low, high)
        given[name] = np.where(rng.random(n) < 1 / 3, at_faces, rng.integers(low, high + 1, n))
    return given


def slow_registers(row, gain):
    values = evaluate(row.program.slow_float, dict(zip(GAINS, map(np.asarray, gain), strict=True)), np.float64)
    return [round(float(v) * 2.0 ** (BITS - place.k)) for v, place in zip(values, row.program.slow, strict=True)]


@pytest.mark.parametrize("gain", [(1.0, 1.0, 1.0), (1.05, 0.95, 1.05), (0.95, 0.95, 0.95)])
def test_within_the_stated_error_everywhere_in_the_box(row, fitted, board, gain):
    given = inside(row, 20000)
    found = execute(row.program, given, slow_registers(row, gain))  # raises where anything leaves 32 bits
    values = {n: v * 2.0 ** (row.program.inputs[n].k - BITS) for n, v in given.items()}
    values |= {name: np.full(20000, g) for name, g in zip(GAINS, gain, strict=True)}
    exact = evaluate(narrow(trace_row(fitted, settings.row_scales(board), False)), values, np.float64)
    for n, place, wanted in zip(found, row.program.outputs, exact, strict=True):
        assert np.max(np.abs(n * 2.0 ** (place.k - BITS) - wanted)) <= place.error
    assert row.error_ut < 3e-3  # less than the noise of a row, 4 nT
    assert row.range_ut >= 67.0


def test_a_range_without_proof_is_refused(fitted, board):
    bent = replace(fitted, p=np.where(np.abs(fitted.p) < 1e-3, 15.0 * fitted.p, fitted.p))
    assert hot.hot_row(bent, board, TEMPS_C) is None


SCRIPT = """
import json, struct, micropython
from array import array
import bp_hot, bp_board, bp_calibration, bp_report
from bp_compensate import Compensator
from bp_fast import FastRow
class Sampler:
    samples, cycles, clipped = bp_board.SAMPLES_PER_HALF, 1, 0
rows, gain, offset = json.loads(open("rows.json").read())
compensator = Compensator(bp_board, bp_calibration)
compensator.gain, compensator.offset_lsb = tuple(gain), tuple(offset)
fast = FastRow(bp_hot, bp_board.SAMPLES_PER_HALF, 68)
fast.put_in_force(compensator)
assert fast.ready
sampler, limbs, kept = Sampler(), array("H", (7, 0, 3, 0)), bytearray(94 * len(rows))
sums = [array("i", row) for row in rows]
view = memoryview(kept)
spots = [view[94 * i : 94 * i + 94] for i in range(len(rows))]
micropython.heap_lock()
for i in range(len(rows)):
    line = fast.line(sums[i], limbs, i)
    spots[i][:] = line
micropython.heap_unlock()
for i in range(len(rows)):
    sampler.sums = sums[i]
    figures = struct.unpack(bp_report.ROW_FORMAT, bp_report.row(sampler, compensator, 1))[7:]
    print(json.dumps([str(spots[i], "utf8"), figures]))
"""


@pytest.fixture(scope="module")
def ran(board, calibration, micropython, tmp_path_factory):
    """Frames that MicroPython made with its heap locked, the float version's figures, and what went in."""
    fast = replace(board, flip=replace(board.flip, rate_hz=300.0))
    folder = build(fast, calibration, tmp_path_factory.mktemp("hot") / "out", path="viper").folder / "src"
    made = generate(fast, calibration, "viper").hot
    given = inside(made, ROWS, seed=8)
    sums = []
    for name in SUMS:
        shift = BITS - made.program.inputs[name].k
        at = SUMS.index(name)
        if at >= 6:
            sums.append(given[name] >> shift)
            continue
        offset = round(OFFSET_LSB[at % 3] * (fast.adc.samples_per_half << shift))
        low, high = hot._limits(made.program.inputs[name])
        inner = np.clip(given[name], low + (1 << shift), high - (1 << shift))  # whole sums inside
        sums.append((offset + (inner if at < 3 else -inner)) >> shift)
    table = np.array(sums).T.tolist()
    (folder / "rows.json").write_text(json.dumps([table, GAIN, OFFSET_LSB]))
    lines, twin = zip(*map(json.loads, micropython(SCRIPT, folder).splitlines()), strict=True)
    return made, "".join(lines), np.array(twin), table


def test_micropython_allocates_nothing_and_meets_the_float_version(ran):
    made, kept, twin, sums = ran
    stream = decode(kept.encode())
    assert (len(stream.frames), stream.damaged, stream.lost) == (ROWS, 0, 0)
    kind = np.dtype([("t", "<u8"), ("sums", "<i4", 6), ("figures", "<f4", 8)])
    found = np.frombuffer(b"".join(f.payload for f in stream.frames), kind)
    assert [f.sequence for f in stream.frames] == list(range(ROWS))
    assert np.all(found["t"] == 7 + (3 << 32))
    assert np.array_equal(found["sums"], np.array(sums)[:, :6])
    off = np.abs(found["figures"] - twin)
    single = np.abs(twin) * 2.0**-23  # both are packed as float32, each rounded to nearest
    assert np.all(off[:, 5:] <= made.error_ut + single[:, 5:] * 1.01)
    assert np.all(off[:, :5] <= [v.error for v in made.program.outputs[:5]] + single[:, :5] * 1.01)


OUTSIDE = """
import json
from array import array
import bp_hot, bp_board, bp_calibration
from bp_compensate import Compensator
from bp_fast import FastRow
sums = json.loads(open("rows.json").read())[0][0]
compensator = Compensator(bp_board, bp_calibration)
fast = FastRow(bp_hot, bp_board.SAMPLES_PER_HALF, 68)
found = []
for name, first in (("gain", 1.0), ("gain", 1.2), ("offset_lsb", 3e6), ("offset_lsb", float("nan"))):
    setattr(compensator, name, (first, 1.0, 1.0))
    fast.put_in_force(compensator)
    found.append(fast.ready)
    compensator = Compensator(bp_board, bp_calibration)
fast.put_in_force(compensator)
for most in (8 * 0x7FFFFF, -8 * 0x800000):
    for axis in range(6):
        full = array("i", sums)
        full[axis] = most
        found.append(fast.line(full, array("H", (0, 0, 0, 0)), 0) is None)
print(json.dumps(found))
"""


def test_what_lies_outside_is_left_to_the_float_version(ran, micropython, board, calibration, tmp_path):
    _, _, _, table = ran
    folder = build(board, calibration, tmp_path / "out", path="viper").folder / "src"
    (folder / "rows.json").write_text(json.dumps([table[:1]]))
    found = json.loads(micropython(OUTSIDE, folder))
    assert found[:4] == [True, False, False, False]
    assert found[4:] == [True] * 12


def test_bytecode_where_it_fits_and_viper_above(board, calibration):
    def chosen(rate_hz, **how):
        flip = replace(board.flip, rate_hz=rate_hz, settle_us=100.0)
        adc = replace(board.adc, sample_hz=32000.0, samples_per_half=8)
        return generate(replace(board, flip=flip, adc=adc), calibration, **how).path

    assert [chosen(hz).name for hz in (100.0, 200.0, 500.0, 1000.0)] == ["bytecode", "bytecode", "viper", "viper"]
    assert "asked for" in chosen(1000.0, path="bytecode").why
    with pytest.raises(InputError, match="one of auto, bytecode, viper"):
        chosen(200.0, path="fast")


def test_budget_says_which_path_and_how_exact(board, calibration, tmp_path):
    made = build(board, calibration, tmp_path / "out", path="viper").budget
    assert made["time_us"]["path"] == "viper"
    assert "us in bytecode" in made["time_us"]["path_why"]
    assert made["time_us"]["sample"] == made["time_us"]["row_by_path"]["viper"]
    assert made["time_us"]["row_by_path"]["viper"] < made["time_us"]["row_by_path"]["bytecode"]
    assert 0 < made["fixed_point"]["error_nt"] < 3.0
    assert "bp_hot" in made["ram_on_import_bytes"]


def test_a_calibration_without_fixed_point_stays_in_bytecode(generated, board):
    fast = replace(board, flip=replace(board.flip, rate_hz=1000.0))
    assert rows.choose_path("auto", generated.programs, None, fast).name == "bytecode"
    with pytest.raises(LimitError, match="fits into fixed point"):
        rows.choose_path("viper", generated.programs, None, fast)


OPERATIONS = (ast.BinOp, ast.UnaryOp, ast.Compare, ast.Subscript, ast.Assign, ast.AugAssign, ast.While, ast.If)


def operations(nodes):
    return sum(isinstance(inner, OPERATIONS) for node in nodes for inner in ast.walk(node))


def test_operations_are_counted_in_the_source():
    text = (paths.firmware() / "bp_fixed.py").read_text()
    loops = {
        f.name: next(v for v in f.body if isinstance(v, ast.While))
        for f in ast.parse(text).body
        if isinstance(f, ast.FunctionDef)
    }
    turn = {name: operations(loop.body) + 2 for name, loop in loops.items()}  # its own test and jump
    branch = next(v for v in loops["run"].body if isinstance(v, ast.If))
    inner = next(v for v in ast.walk(loops["floats"]) if isinstance(v, ast.While) and v is not loops["floats"])
    assert turn["run"] - operations(branch.body) == rows.PRODUCT
    assert turn["run"] - operations(branch.orelse) == rows.SUM
    assert turn["floats"] - operations([inner]) == rows.FLOAT
    assert operations([inner]) == rows.NORMALISE
    counted = [turn[name] for name in ("take", "copy", "crc16", "base64", "sum24")]
    assert counted == [rows.TAKE, rows.COPY, rows.CRC, rows.BASE64, rows.SUM24]
    compiled = len(compile_module("bp_fixed.py", text)) / operations([ast.parse(text)])
    assert 8.0 < compiled < 13.5  # bytes an operation: 4.5 instructions of two bytes, a few of four


STREAM = """
import json, sys, micropython, time
from array import array
import bp_hot, bp_board, bp_calibration, bp_records, bp_report, bp_serve
from bp_clock import Clock
from bp_compensate import Compensator
from bp_console import Console
from bp_fast import FastRow
class Sampler:
    samples, cycles, clipped, lost, mid_us = bp_board.SAMPLES_PER_HALF, 1, 0, 0, 0
    def clear(self): pass
    def stop(self): pass
    def cycle(self): self.mid_us = time.ticks_us()
class Hardware: pass
class Station: pass
station = Station()
station.hardware = Hardware()
station.hardware.sampler = sampler = Sampler()
station.hardware.compensator = Compensator(bp_board, bp_calibration)
rows, gain, offset = json.loads(open("rows.json").read())
sampler.sums = array("i", rows[0])
station.hardware.compensator.gain, station.hardware.compensator.offset_lsb = tuple(gain), tuple(offset)
station.clock, station.console, station.rows = Clock(), Console(), 0
kept, at = bytearray(60000), 0
def write(text):
    global at
    for byte in text:
        kept[at] = byte
        at += 1
station.writer = bp_records.Writer(write)
station.fast = FastRow(bp_hot, bp_board.SAMPLES_PER_HALF, bp_records.ROW)
station.fast.put_in_force(station.hardware.compensator)
assert station.fast.ready
head = bp_report.header("00", 1)
station.said = (bp_report.again(bp_records.HEADER, head), bp_report.again(bp_records.RESULT, {"accepted": True}))
seen = bp_serve._Seen(sampler)
micropython.heap_lock()
for _ in range(300):
    bp_serve.row(station, seen)
    station.console.command()
micropython.heap_unlock()
sys.stdout.buffer.write(memoryview(kept)[:at])
"""


def test_the_whole_stream_allocates_nothing(ran, micropython, board, calibration, tmp_path):
    """Rows, time, sequence, the header and the verdict that are said again, and looking for commands."""
    _, _, _, table = ran
    folder = build(board, calibration, tmp_path / "out", path="viper").folder / "src"
    (folder / "rows.json").write_text(json.dumps([table[:1], GAIN, OFFSET_LSB]))
    stream = decode(micropython(STREAM, folder).encode())
    kinds = [f.type for f in stream.frames]
    assert (kinds.count("D"), kinds.count("H"), kinds.count("S")) == (300, 1, 1)
    assert (stream.damaged, stream.lost) == (0, 0)
    times = [int.from_bytes(f.payload[:8], "little") for f in stream.frames if f.type == "D"]
    assert times == sorted(times)
