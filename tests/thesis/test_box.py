"""A box laid on clouds of it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from thesis.chapter4.box import outline_distance, place_box

SIZE = np.array([0.142, 0.124, 0.0104])


@pytest.fixture(scope="module")
def scene():
    """Top and front of a box and the table, dense near the camera, camera frame."""
    rng = np.random.default_rng(2)
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", [-2.2, 0.05, 0.3]).as_matrix()
    pose[:3, 3] = [0.03, 0.05, 0.6]
    x = rng.uniform(-0.071, 0.071, 14000)
    y = 0.124 * rng.beta(1.0, 1.4, 14000) - 0.062
    top = np.column_stack([x, y, np.full(14000, SIZE[2])])
    front = np.column_stack([x[:900], np.full(900, -0.062), rng.uniform(0, SIZE[2], 900)])
    ground = np.column_stack([rng.uniform(-0.2, 0.2, (20000, 2)), np.zeros(20000)])
    ground = ground[outline_distance(ground[:, :2], SIZE) > 0]
    points = np.concatenate([top, front, ground]) + rng.normal(0, 4e-4, (len(ground) + 14900, 3))
    hidden = np.hypot(points[:, 0] - 0.02, points[:, 1] - 0.04) < 0.012
    stray = rng.uniform(-0.1, 0.1, (60, 3)) * [1, 1, 0.1] + [0, 0, 0.02]
    points = np.concatenate([points[~hidden], stray]) @ pose[:3, :3].T + pose[:3, 3]
    return points, np.append(pose[:3, 2], -pose[:3, 2] @ pose[:3, 3]), pose


def test_the_box_is_laid_where_it_stands(scene):
    points, plane, pose = scene
    apart = np.linalg.inv(pose) @ place_box(points, plane, SIZE)
    assert np.linalg.norm(apart[:3, 3]) < 4e-4
    assert np.degrees(np.arcsin(np.abs(apart[0, 1]))) < 0.2
    assert apart[:3, :3] @ apart[:3, :3].T == pytest.approx(np.eye(3))


@pytest.mark.parametrize(
    ("size", "seen_to_m", "line"),
    [
        ((0.1, 0.1, 0.05), np.inf, "at least 200 points 50 mm above the table, found"),
        ((0.06, 0.06, 0.0104), np.inf, "differs from it in"),
        ((0.124, 0.142, 0.0104), np.inf, "expected length >= width, found 0.124, 0.142 m"),
        (SIZE, 0.025, "differs from it in"),
    ],
)
def test_another_box_or_one_seen_in_part(scene, size, seen_to_m, line):
    points, plane, pose = scene
    y = (points - pose[:3, 3]) @ pose[:3, 1]
    with pytest.raises(ValueError, match=line):
        place_box(points[y < seen_to_m], plane, size)
