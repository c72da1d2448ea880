"""Numbers behind the figures of tracked surfaces: slides of a cloud, tilted forces."""

import numpy as np
import pytest
import trimesh
from palpate.surface.template import Template, refine_template
from thesis.chapter5 import force_direction, rigid_slide


def block(edge_m=0.02):
    mesh = trimesh.creation.box((0.6, 0.15, 0.05))
    rough = Template(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    return refine_template(rough, np.zeros(3), radius_m=1.0, edge_m=edge_m)


def top_and_front(low_m, high_m):
    """Captured points of the block's upper and front face between two places along it."""
    x, y = np.meshgrid(np.arange(-0.3, 0.3001, 0.005), np.arange(-0.075, 0.0751, 0.005))
    top = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 0.025)])
    x, z = np.meshgrid(np.arange(-0.3, 0.3001, 0.005), np.arange(-0.02, 0.021, 0.005))
    front = np.column_stack([x.ravel(), np.full(x.size, -0.075), z.ravel()])
    normals = np.repeat([[0, 0, 1.0], [0, -1.0, 0]], [len(top), len(front)], axis=0)
    points = np.vstack([top, front])
    kept = rigid_slide.without_ends(points, low_m=low_m, high_m=high_m)
    return points[kept], normals[kept]


def test_a_cloud_without_ends_slides_and_added_ends_hold_it():
    right, options = np.eye(4), {"largest_distance_m": 0.012, "largest_normal_deg": 60}
    template, (points, normals) = block(), top_and_front(-0.02, 0.27)
    start = rigid_slide.shifted(right, 0.01)
    slid = rigid_slide.align_to_nearest(template, points, normals, start, **options)
    left = rigid_slide.slide(slid, right, np.zeros(3))
    assert abs(left) > 0.005
    y, z = np.meshgrid(np.arange(-0.07, 0.071, 0.005), np.arange(-0.02, 0.021, 0.005))
    ends = [np.column_stack([np.full(y.size, x), y.ravel(), z.ravel()]) for x in (-0.3, 0.3)]
    outward = np.repeat([[-1.0, 0, 0], [1.0, 0, 0]], y.size, axis=0)
    whole = np.vstack([points, *ends]), np.vstack([normals, outward])
    held = rigid_slide.align_to_nearest(template, *whole, start, **options)
    assert abs(rigid_slide.slide(held, right, np.zeros(3))) < abs(left)


def test_slide_is_the_shift_along_the_block():
    pose = np.eye(4)
    pose[:3, :3] = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3])[:3, :3]
    found = rigid_slide.slide(rigid_slide.shifted(pose, 0.03), pose, np.array([0.1, 0, 0]))
    assert found == pytest.approx(0.03)


def test_a_cloud_far_away_is_refused():
    points, normals = top_and_front(-0.2, 0.2)
    with pytest.raises(ValueError, match="cloud_m: expected points near the template"):
        rigid_slide.align_to_nearest(
            block(0.05), points + 1, normals, np.eye(4),
            largest_distance_m=0.01, largest_normal_deg=60,
        )  # fmt: skip


def test_a_tilted_force_keeps_its_size_and_leans_by_the_angle():
    force = force_direction.tilted(np.array([0, 0, -8.0]), np.array([0, 0, 2.0]), 15)
    assert np.linalg.norm(force) == pytest.approx(8)
    assert -force[2] / 8 == pytest.approx(np.cos(np.deg2rad(15)))
