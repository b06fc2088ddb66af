"""Trajectories: geometry, balance, limits, and the codes that the board plays."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from barberpole.board import load_board
from barberpole.errors import InputError, LimitError
from barberpole.trajectory import axes, code_table, for_board, replay, sine, sphere, steps
from barberpole.trajectory.shapes import direction

BOARD = load_board("pybv11")
RADII = (40.0, 80.0)


@pytest.fixture
def ball():
    return sphere(RADII, 132)


def test_direction_is_equation_6_1():
    alpha, beta = 0.3, -1.2
    expected = [np.cos(alpha) * np.cos(beta), np.cos(alpha) * np.sin(beta), np.sin(alpha)]
    np.testing.assert_allclose(direction(alpha, beta), expected, rtol=1e-15)


def test_sphere_lies_on_its_radii(ball):
    radius = np.linalg.norm(ball.field_ut, axis=1)
    assert sorted(set(np.round(radius, 9))) == list(RADII)


def test_antipodes_are_neighbours_in_time(ball):
    np.testing.assert_array_equal(ball.field_ut[0::2], -ball.field_ut[1::2])


def test_every_block_is_balanced(ball):
    blocks = ball.field_ut.reshape(-1, ball.block, 3)
    np.testing.assert_allclose(blocks.mean(axis=1), 0.0, atol=1e-12)
    mean_square = (40.0**2 + 80.0**2) / 2 / 3
    np.testing.assert_allclose((blocks**2).mean(axis=1), mean_square, rtol=1e-12)


def test_sphere_regressors_are_orthogonal(ball):
    gram = ball.field_ut.T @ ball.field_ut
    np.testing.assert_allclose(gram, np.diag(np.diag(gram)), atol=1e-9 * gram[0, 0])


def test_sphere_covers_all_octants(ball):
    assert len({tuple(row) for row in np.sign(ball.field_ut).astype(int)}) >= 8


def test_two_radii_tell_a_quadratic_term_from_the_constant():
    """FACTS of the method: on one sphere x² + y² + z² is a constant, on two it is not."""

    def rank(radii):
        b = sphere(radii, 36).field_ut / 80.0
        return np.linalg.matrix_rank(np.column_stack([np.ones(len(b)), b, b**2]), tol=1e-9)

    assert rank((80.0,)) == 6
    assert rank(RADII) == 7


@pytest.mark.parametrize(("radii", "points"), [((40.0, 80.0), 128), ((40.0,), 0), ((), 12), ((-1.0,), 6)])
def test_sphere_refuses(radii, points):
    with pytest.raises(InputError, match="must be"):
        sphere(radii, points)


def test_axes_drives_one_coil_at_a_time():
    run = axes((20.0, 60.0), repeats=2)
    assert np.count_nonzero(run.field_ut, axis=1).max() == 1
    assert run.points == 24
    np.testing.assert_allclose(run.field_ut.reshape(-1, run.block, 3).mean(axis=1), 0.0)


def test_steps_and_sine():
    stairs = steps((0.0, 10.0, -5.0), "y", hold=2)
    np.testing.assert_array_equal(stairs.field_ut[:, 1], [0, 0, 10, 10, -5, -5])
    wave = sine(30.0, "z", cycles=2, points_per_cycle=8)
    assert wave.points == 16
    assert abs(wave.field_ut[:, 2].mean()) < 1e-12
    assert wave.field_ut[2, 2] == pytest.approx(30.0)
    with pytest.raises(InputError, match="one of x, y, z"):
        steps((1.0,), "w")
    with pytest.raises(InputError, match="sine"):
        sine(1.0, "x", 1, 2)


class FakeLog(SimpleNamespace):
    def has(self, name):
        return name in self.columns

    def __getitem__(self, name):
        return self.columns[name]


def test_replay_takes_even_rows_and_names_what_is_missing():
    columns = {name: np.arange(11.0) * k for k, name in enumerate(("bx_ut", "by_ut", "bz_ut"))}
    run = replay(FakeLog(columns=columns, n=11, path="a.csv"), 6)
    np.testing.assert_array_equal(run.field_ut[:, 1], [0, 2, 4, 6, 8, 10])
    with pytest.raises(InputError, match="no bz_ut"):
        replay(FakeLog(columns={"bx_ut": columns["bx_ut"], "by_ut": columns["by_ut"]}, n=11, path="a.csv"), 6)
    with pytest.raises(InputError, match="rows"):
        replay(FakeLog(columns=columns, n=11, path="a.csv"), 12)


def test_codes_give_the_field_within_half_a_code(ball):
    table = code_table(ball, BOARD)
    constant = BOARD.sensor.offset_coil_ut_per_ma
    half_code_ut = 0.5 * max(table.full_scale_ma) / table.zero * constant
    assert np.max(np.abs(table.current_ma * constant - ball.field_ut)) <= half_code_ut * (1 + 1e-9)
    assert np.max(np.abs(table.units)) == 1.0
    assert len(table.bytes) == 6 * ball.points
    assert np.frombuffer(table.bytes, "<u2").reshape(-1, 3)[5, 2] == table.codes[5, 2]


def test_id_changes_with_a_code_and_is_stable(ball):
    table = code_table(ball, BOARD)
    assert table.id == code_table(sphere(RADII, 132), BOARD).id
    moved = table.codes.copy()
    moved[7, 0] += 1
    assert replace(table, codes=moved).id != table.id


def test_board_limits_are_refused_with_figures():
    with pytest.raises(LimitError, match=r"coil current must be at most 4.5 mA \(coils.max_ma\); got 4.6"):
        code_table(sphere((100.0,), 6), BOARD)
    with pytest.raises(LimitError, match=r"coil field must be at most 600 µT .* got 700"):
        code_table(steps((700.0,), "x"), BOARD)


def test_the_board_file_gives_its_own_run():
    run = for_board(BOARD)
    assert run.points == BOARD.selfcal.points
    assert run.block == 6 * len(BOARD.selfcal.radii_ut)
