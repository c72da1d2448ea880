"""Parts of how a box is laid: axes, plan, rectangle and registration, each on exact points."""

import numpy as np
import pytest
from palpate.vision.box import CELL_M, _laid, _plan, _plane_axes, _registered, _turned
from palpate.vision.foreground import _without_small

SIZE = np.array([0.14, 0.12, 0.01])


@pytest.mark.parametrize("normal", [[0, 0, 1.0], [0.6, 0, -0.8], [0.1, -0.7, 0.2]])
def test_axes_in_a_plane(normal):
    normal = np.array(normal) / np.linalg.norm(normal)
    axes = np.vstack([_plane_axes(normal), normal])
    assert axes @ axes.T == pytest.approx(np.eye(3))
    assert np.linalg.det(axes) == pytest.approx(1)


def test_places_seen_from_turned_axes():
    found = _turned(np.array([[1.0, 0], [0, 2.0]]), np.deg2rad(30))
    half, root = 0.5, np.sqrt(0.75)
    assert found == pytest.approx(np.array([[root, -half], [2 * half, 2 * root]]))


def rectangle(middle, angle, step=0.0007):
    x, y = np.meshgrid(np.arange(-0.07, 0.07, step), np.arange(-0.06, 0.06, step))
    return _turned(np.column_stack([x.ravel(), y.ravel()]), -angle) + middle


def test_the_plan_draws_the_largest_piece():
    top = rectangle([0.3, -0.1], 0.0)
    stray = (
        np.array([0.3, -0.1]) + [0.1, 0] + np.mgrid[0:0.01:0.0005, 0:0.01:0.0005].reshape(2, -1).T
    )
    hole = np.hypot(*(top - [0.3, -0.1]).T) < 0.003
    cells, drawn = _plan(np.concatenate([top[~hole], stray]))
    inside = (np.abs(cells - [0.3, -0.1]) < [0.069, 0.059]).all(axis=1)
    outside = (np.abs(cells - [0.3, -0.1]) > [0.071, 0.061]).any(axis=1)
    assert drawn[inside].all() and not drawn[outside].any()
    assert drawn.sum() * CELL_M**2 == pytest.approx(0.14 * 0.12, rel=0.02)
    # Cells of a millimetre, wide enough around what is drawn.
    spread = np.unique(np.round(cells[:, 0], 9))
    assert np.diff(spread) == pytest.approx(CELL_M, rel=1e-3)
    assert spread[0] < 0.3 - 0.07 - 0.05 and spread[-1] > 0.3 + 0.07 + 0.05


def test_the_rectangle_is_laid_on_what_is_drawn():
    """On cells of 4 mm, and with two sevenths of it missing."""
    middle, angle = np.array([0.02, -0.03]), -1.2
    cells = np.mgrid[-0.08:0.12:0.004, -0.13:0.07:0.004].reshape(2, -1).T
    placed = _turned(cells - middle, angle)
    drawn = (np.abs(placed) < [0.07, 0.06]).all(axis=1)
    found, turn, apart = _laid(cells, drawn, SIZE[:2])
    assert found == pytest.approx(middle, abs=1e-3)
    assert np.abs(np.sin(turn - angle)) < 0.02
    assert apart < 0.03
    half = drawn & (placed[:, 0] < 0.03)
    assert _laid(cells, half, SIZE[:2])[2] == pytest.approx(2 / 7, abs=0.05)


def test_points_of_top_and_sides_move_the_box_to_them():
    angle, middle = 0.2, np.array([0.01, 0.02])
    flat = rectangle(middle, angle, 0.003)
    top = np.column_stack([flat, np.full(len(flat), SIZE[2])])
    edge = np.linspace(-0.06, 0.06, 60)
    side = _turned(np.column_stack([np.full(60, -0.07), edge]), -angle) + middle
    front = _turned(np.column_stack([edge, np.full(60, -0.06)]), -angle) + middle
    sides = [np.column_stack([part, np.full(60, 0.004)]) for part in (side, front)]
    # Something else on the table, too far to be the box.
    stray = np.column_stack([middle + np.full((30, 2), 0.09), np.full(30, 0.005)])
    scene = np.concatenate([top, *sides * 20, stray])
    found, turn = _registered(scene, SIZE, middle + [0.0015, -0.001], angle + 0.01)
    assert found == pytest.approx(middle, abs=5e-5)
    assert turn == pytest.approx(angle, abs=1e-3)


def test_pieces_that_are_too_small():
    mask = np.zeros((20, 30), np.uint8)
    mask[2:6, 2:6], mask[10:13, 10:15] = 1, 1
    # A pixel that touches a piece by its corner is none of it.
    mask[6, 6] = 1
    kept = _without_small(mask, 16)
    assert kept[2:6, 2:6].all() and kept.sum() == 16
    assert _without_small(mask, 15).sum() == 31 and not _without_small(mask, 17).any()
