"""The table's plane: of points, of several planes, and as its file has it."""

import json

import numpy as np
import pytest
from palpate.vision.support_plane import fit_support_plane, height_above, read_plane


def scene(*patches, noise_m=5e-4):
    """Points on level planes at heights below the camera and on a wall, in front of it."""
    rng = np.random.default_rng(1)
    found = []
    for centre, along, across, count in patches:
        place = rng.uniform(-0.5, 0.5, (count, 2))
        flat = np.array(centre) + place @ np.array([along, across])
        normal = np.cross(along, across)
        found.append(flat + rng.normal(0, noise_m, (count, 1)) * normal / np.linalg.norm(normal))
    return np.concatenate(found)


def table(points):
    return fit_support_plane(points, inlier_distance_m=0.004, rng=np.random.default_rng(0))


def test_the_nearest_level_plane_in_the_middle_is_the_table():
    """A small table before a larger floor and a wall, which the camera sees from above."""
    slope = np.array([0.0, 0.6, -0.8])
    small = ([0, 0.1, 0.7], [0.4, 0, 0], 0.3 * slope, 3000)
    floor = ([0, 0.5, 1.2], [2.0, 0, 0], 1.5 * slope, 9000)
    wall = ([0, 0.0, 2.0], [2.0, 0, 0], [0, 2.0, 0], 3000)
    found = table(scene(small, floor, wall))
    up = np.array([0, -0.8, -0.6])
    assert found[:3] @ up == pytest.approx(1, abs=1e-3)
    assert found[3] == pytest.approx(-up @ small[0], abs=2e-3)
    # Without any level plane the wall is all there is.
    assert table(scene(wall)) == pytest.approx([0, 0, -1, 2.0], abs=2e-3)


def test_support_plane_among_clutter():
    rng = np.random.default_rng(1)
    normal = np.array([0.1, -0.7, -0.7])
    normal /= np.linalg.norm(normal)
    ground = rng.uniform(-0.4, 0.4, (5000, 2))
    a, b = np.linalg.svd(normal[None])[2][1:]
    points = [0, 0, 0.8] + ground @ np.stack([a, b]) + rng.normal(0, 1e-3, (5000, 1)) * normal
    clutter = [0, 0, 0.7] + rng.uniform(-0.1, 0.1, (1500, 3))
    plane = table(np.concatenate([points, clutter]))
    assert np.degrees(np.arccos(plane[:3] @ normal)) < 0.1
    assert abs(height_above(plane, np.array([[0, 0, 0.8]]))[0]) < 3e-4
    with pytest.raises(ValueError, match="at least 100 points, found 3"):
        table(points[:3])


def test_false_matches_are_no_table():
    """What a stereo head makes of a table of one colour: depths of any size."""
    rng = np.random.default_rng(2)
    rays = np.column_stack([rng.uniform(-0.5, 0.5, (20000, 2)), np.ones(20000)])
    points = rays / rng.uniform(1 / 1.5, 1 / 0.4, (20000, 1))
    with pytest.raises(ValueError, match="25% or more .* 3% .a table without a pattern"):
        fit_support_plane(points, inlier_distance_m=0.004, rng=rng)


@pytest.mark.parametrize(
    ("content", "line"),
    [
        ("nothing", "file: expected JSON, found none"),
        ('{"normal": [0, 0], "offset_m": 1}', "normal: expected finite numbers of shape"),
        ('{"normal": [0, 0, 1]}', "offset_m: expected a value, found none"),
        ('{"normal": [0, 0, 1.002], "offset_m": 1}', "normal: expected a unit vector, found"),
    ],
)
def test_files_that_hold_no_plane(tmp_path, content, line):
    path = tmp_path / "support_plane.json"
    path.write_text(content)
    with pytest.raises(ValueError, match=line):
        read_plane(path)


def test_a_plane_is_read_as_it_was_written(tmp_path):
    path = tmp_path / "support_plane.json"
    path.write_text(json.dumps({"normal": [0, -0.6, -0.8005], "offset_m": 0.7}))
    assert read_plane(path) == pytest.approx([0, -0.6, -0.8005, 0.7])
