"""Streaming Givens in the board's float32 against numpy's least squares in double."""

import json

import numpy as np
import pytest
from barberpole.board import load_board
from barberpole.trajectory import code_table, for_board

UNITS = code_table(for_board(load_board("pybv11")), load_board("pybv11")).units.astype(np.float32)


def problem(seed=0, noise=2e-3):
    """Rows of [1, u] and fields in µT with noise, both as float32 values."""
    rng = np.random.default_rng(seed)
    rows = np.column_stack([np.ones(len(UNITS), np.float32), UNITS])
    truth = np.array([[18.0, -6.0, 44.0], [80.0, 1.5, -1.0], [1.2, 78.0, 0.7], [-0.9, 0.8, 81.0]])
    right = (rows @ truth + noise * rng.standard_normal((len(rows), 3))).astype(np.float32)
    return rows, right


def solve(givens, rows, right):
    for row, side in zip(rows, right, strict=True):
        givens.row[:4], givens.row[4:] = row, side
        givens.add()
    return np.array([givens.solve(k) for k in range(3)], float).T, np.array(givens.rss, float)


def test_float32_meets_lstsq_far_below_the_noise(firmware_float32):
    rows, right = problem()
    found, rss = solve(firmware_float32("bp_givens").Givens(4, 3), rows, right)
    wanted, squares, *_ = np.linalg.lstsq(rows.astype(float), right.astype(float), rcond=None)
    # 132 rotations each round once or twice at 6e-8 of 100 µT: a few 1e-6 of the diagonal at worst, 10 ppm asked
    np.testing.assert_allclose(found, wanted, atol=2e-4)
    gains = np.diag(found[1:]) / np.diag(wanted[1:]) - 1
    assert np.max(np.abs(gains)) < 2e-6
    np.testing.assert_allclose(rss, squares, rtol=0.02)


def test_micropython_meets_lstsq(micropython):
    rows, right = problem(seed=1)
    script = f"""
import json
from bp_givens import Givens
g = Givens(4, 3)
for row in {np.column_stack([rows, right]).astype(float).tolist()}:
    for i in range(7):
        g.row[i] = row[i]
    g.add()
print(json.dumps([g.n, [g.solve(k) for k in range(3)]]))
"""
    n, found = json.loads(micropython(script))
    wanted = np.linalg.lstsq(rows.astype(float), right.astype(float), rcond=None)[0]
    assert n == len(rows)
    np.testing.assert_allclose(np.array(found).T, wanted, atol=2e-4)


def test_a_dropped_point_changes_nothing_but_the_noise(firmware_float32):
    rows, right = problem(noise=0.0)
    keep = np.arange(len(rows)) % 7 != 3
    module = firmware_float32("bp_givens")
    all_points, _ = solve(module.Givens(4, 3), rows, right)
    some, _ = solve(module.Givens(4, 3), rows[keep], right[keep])
    np.testing.assert_allclose(some, all_points, atol=2e-4)


def test_points_that_determine_nothing_are_refused(firmware_float32):
    rows, right = problem()
    rows[:, 2] = 0
    with (
        pytest.raises((ZeroDivisionError, FloatingPointError)),
        np.errstate(all="raise"),
    ):
        solve(firmware_float32("bp_givens").Givens(4, 3), rows, right)
