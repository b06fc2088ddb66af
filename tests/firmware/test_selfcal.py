"""The self-calibration's arithmetic: the board's (MicroPython, and float32) and the host's, on the same points."""

import json
from pathlib import Path

import numpy as np
import pytest
from barberpole.board_log import SelfcalRun
from barberpole.fitted import from_calibration
from barberpole.selfcal import factory_reference, recompute, slope_lsb_per_ut, split

AMBIENT_UT = np.array([18.0, -6.0, 44.0])
COUPLING = np.array([[1.0, 0.02, -0.012], [0.018, 1.0, 0.009], [-0.014, 0.011, 1.0]])
DRIFT = np.array([1.02, 0.985, 1.01])
NOISE_LSB = 12.0


def make_run(fitted, table, coil_ut_per_ma, gain=(1.0, 1.0, 1.0), offset_lsb=(0.0, 0.0, 0.0), step_ut=0.0, seed=0):
    """Points of a coil run by the model's own forward direction, float32 as in the board's frames."""
    rng = np.random.default_rng(seed)
    _, inner = split(fitted.model)
    unit = table.units.T.astype(np.float32).astype(float)
    n = unit.shape[1]
    ambient = np.repeat(AMBIENT_UT[:, None], n, axis=1)
    ambient[0, n // 2 :] += step_ut
    coil = coil_ut_per_ma * (COUPLING @ (unit * np.array(table.unit_ma)[:, None]))
    readings = []
    for state in (1.0, -1.0):
        at = fitted.conditions(state=state, temp_c=np.full(n, 25.0), coil_ut=coil, gain=gain)
        xyz = ambient  # the cross field, first of the inner effects, adds the coil
        for term in inner.terms:
            xyz = term.effect.forward(xyz, fitted.p[term.at], at)
        raw = state * np.stack(xyz) + np.array(offset_lsb)[:, None] + NOISE_LSB * rng.standard_normal((3, n))
        readings.append(raw.astype(np.float32).astype(float))
    header = {"trajectory": table.id, "unit_ma": list(table.unit_ma), "block": table.block}
    current = table.current_ma.T.astype(np.float32).astype(float)
    return SelfcalRun(header, np.arange(n), unit, *readings, current, np.full(n, 25.0), None)


@pytest.fixture(scope="module")
def fitted(calibration):
    return from_calibration(calibration)


@pytest.fixture(scope="module")
def reference(fitted, table, board):
    return factory_reference(make_run(fitted, table, 22.0, seed=9), fitted, board.sensor.offset_coil_ut_per_ma)


def test_reference_is_the_coils_response(reference, table):
    wanted = 22.0 * COUPLING * np.array(table.unit_ma)
    np.testing.assert_allclose(reference.gain_ut_per_unit, wanted, atol=2e-3)
    assert reference.trajectory == table.id


def test_host_finds_todays_gains(fitted, table, reference):
    run = make_run(fitted, table, 22.0, gain=DRIFT)
    found = recompute(run, fitted, reference.gain_ut_per_unit)
    np.testing.assert_allclose(found.gain, DRIFT, rtol=60e-6)  # noise alone gives about 10 ppm
    np.testing.assert_allclose(found.ambient_ut, AMBIENT_UT, atol=3e-3)
    assert found.step_ut < 0.01


def test_an_unknown_electronic_offset_is_found_on_the_way(fitted, table, reference):
    """50 µT of bridge offset that the model does not have: first order through the cross field, 2 % of gain if left."""
    offset = 50.0 * slope_lsb_per_ut(fitted) * np.array([1.0, -0.6, 0.8])
    run = make_run(fitted, table, 22.0, gain=DRIFT, offset_lsb=offset)
    found = recompute(run, fitted, reference.gain_ut_per_unit)
    np.testing.assert_allclose(found.gain, DRIFT, rtol=60e-6)
    np.testing.assert_allclose(found.ambient_ut, AMBIENT_UT, atol=3e-3)


def test_a_step_of_the_ambient_field_is_seen_in_full(fitted, table, reference):
    found = recompute(make_run(fitted, table, 22.0, step_ut=1.0), fitted, reference.gain_ut_per_unit)
    assert found.step_ut == pytest.approx(1.0, abs=0.1)


SCRIPT = """
import json, struct
import bp_board, bp_calibration, bp_selfcal, bp_trajectory
from bp_points import Points
points = Points(bp_trajectory.POINTS)
for row in json.loads(open("points.json").read()):
    points.put(row[0:3], row[3:9], row[9:12], row[12])
s = bp_selfcal.solve(points, bp_calibration, bp_trajectory, bp_calibration.GAIN_DRIFT_LIMIT)
ratios = bp_selfcal.current_ratio(points, bp_trajectory)
print(json.dumps([s.gain, s.ambient_ut, s.residual_ut, s.step_ut, ratios,
                  bp_selfcal.judge(s, ratios, bp_calibration, bp_board)]))
"""


@pytest.fixture(scope="module")
def on_board(micropython, build_with, tmp_path_factory, reference):
    """Solve a run in MicroPython with the modules generated for the reference."""
    sources: Path = build_with(reference) / "src"

    def solve(run):
        folder = tmp_path_factory.mktemp("run")
        rows = np.vstack([run.unit, run.set_lsb, run.reset_lsb, run.current_ma, run.temp_c[None]]).T
        (folder / "points.json").write_text(json.dumps(rows.tolist()))
        return json.loads(micropython(SCRIPT, sources, cwd=folder))

    return solve


def test_board_and_host_agree(on_board, fitted, table, reference):
    offset = 30.0 * slope_lsb_per_ut(fitted)
    run = make_run(fitted, table, 22.0, gain=DRIFT, offset_lsb=offset, seed=3)
    gain, ambient, residual, step, ratios, codes = on_board(run)
    host = recompute(run, fitted, reference.gain_ut_per_unit)
    np.testing.assert_allclose(gain, host.gain, rtol=5e-6)  # float32 triangle and constants; 10 ppm is promised
    np.testing.assert_allclose(ambient, host.ambient_ut, atol=1e-3)
    np.testing.assert_allclose(residual, host.residual_ut, rtol=0.05)
    assert step == pytest.approx(host.step_ut, abs=1e-4)
    np.testing.assert_allclose(ratios, 1.0, atol=1e-6)
    assert codes == []


@pytest.mark.parametrize(
    ("changes", "codes"),
    [
        ({"step_ut": 1.0}, [2, 1]),
        ({"gain": (1.08, 1.0, 1.0)}, [3]),
    ],
)
def test_board_refuses_with_the_cause_first(on_board, fitted, table, changes, codes):
    assert on_board(make_run(fitted, table, 22.0, **changes))[5] == codes


def test_board_refuses_an_open_coil(on_board, fitted, table):
    run = make_run(fitted, table, 22.0)
    run.current_ma[1] = 0.0
    run.set_lsb[1], run.reset_lsb[1] = run.set_lsb[1].mean(), run.reset_lsb[1].mean()
    assert on_board(run)[5][0] == 5


NO_NUMBERS = """
import json
import bp_board, bp_calibration, bp_selfcal, bp_trajectory
def measure(points, *_):
    for k in range(bp_trajectory.POINTS):
        reading = float(%r) if k == 40 else 1e5
        points.put((k %% 2, k %% 3, k %% 5), [reading] * 6, (3.0, 3.0, 3.0), 25.0)
bp_selfcal.measure = measure
result = bp_selfcal.run(None, None, None, bp_trajectory, bp_calibration, bp_board)
print(json.dumps([result.reasons, result.solution is None, result.accepted]))
"""


@pytest.mark.parametrize("reading", ["nan", "inf"])
def test_what_is_no_number_is_never_accepted(micropython, build_with, reference, reading):
    """No comparison with nan holds, so it would exceed no limit."""
    assert json.loads(micropython(NO_NUMBERS % reading, build_with(reference) / "src")) == [[15], True, False]


def test_all_of_it_in_float32(firmware_float32, fitted, table, reference, build_with):
    """undo_coil and the rotations with every operation rounded to float32, as on the STM32F4, against double."""
    namespace: dict = {"sqrt": np.sqrt}
    text = (build_with(reference) / "src" / "bp_calibration.py").read_text().replace("from math import sqrt", "")
    exec(text, namespace)
    run = make_run(fitted, table, 22.0, gain=DRIFT, seed=4)
    givens = firmware_float32("bp_givens").Givens(4, 3)
    rows = np.column_stack([np.ones(table.points), run.unit.T])
    for row, field in zip(rows, die_field(namespace, run, np.float32), strict=True):
        assert field.dtype == np.float32
        givens.row[:4], givens.row[4:] = row, field
        givens.add()
    single = np.array([givens.solve(i)[1 + i] for i in range(3)], float)
    double = np.linalg.lstsq(rows, die_field(namespace, run, np.float64), rcond=None)[0]
    assert np.max(np.abs(single / np.diag(double[1:]) - 1.0)) < 1e-6  # 10 ppm is promised


def die_field(namespace, run, kind):
    """(n, 3) by the generated text, every operation in `kind`."""
    factory = np.diag(namespace["FACTORY_GAIN_UT_PER_UNIT"])
    after_set, after_reset = run.set_lsb.astype(kind), (-run.reset_lsb).astype(kind)
    coil = (factory[:, None] * run.unit).astype(kind)
    temp = run.temp_c.astype(kind)
    six = np.stack(namespace["undo_coil"](*after_set, *after_reset, temp, *DRIFT.astype(kind), *coil))
    return (kind(0.5) * (six[:3] + six[3:])).T
