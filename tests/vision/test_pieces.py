"""Connected pieces of clouds."""

import numpy as np
import pytest
from palpate.open3d_core import o3d
from palpate.vision.pieces import largest_piece

GAP_M = 0.010


def chain(count, step_m, start_m=(0.0, 0.0, 0.0)):
    return np.array(start_m) + np.arange(count)[:, None] * [step_m, 0.0, 0.0]


@pytest.mark.parametrize(("step_m", "kept"), [(0.0099, 6), (0.0101, 1)])
def test_points_within_the_gap_hang_together(step_m, kept):
    assert len(largest_piece(chain(6, step_m), GAP_M)) == kept


def test_pieces_beyond_half_the_gap_are_joined():
    parts = [chain(5, 0.002, (0.016 * k, 0, 0)) for k in range(4)]
    apart = chain(19, 0.002, (0, 0.5, 0))
    np.testing.assert_array_equal(
        largest_piece(np.concatenate([apart, *parts]), GAP_M), 19 + np.arange(20)
    )


def test_of_equal_pieces_the_first_is_kept():
    points = np.concatenate([chain(3, 0.002, (0, 0.1 * k, 0)) for k in range(3)])
    np.testing.assert_array_equal(largest_piece(points, GAP_M), [0, 1, 2])


@pytest.mark.parametrize("spread_m", [0.02, 0.03, 0.05])
def test_agrees_with_dbscan_of_single_points(spread_m):
    points = np.random.default_rng(7).normal(0, spread_m, (1500, 3))
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    labels = np.asarray(cloud.cluster_dbscan(GAP_M, min_points=1))
    expected = np.flatnonzero(labels == np.bincount(labels).argmax())
    assert 1 < len(expected) < len(points)
    np.testing.assert_array_equal(largest_piece(points, GAP_M), expected)


def test_bad_input_is_refused():
    with pytest.raises(ValueError, match=r"points_m: expected points of a cloud, found none"):
        largest_piece(np.zeros((0, 3)), GAP_M)
    with pytest.raises(ValueError, match=r"gap_m: expected a length above 0 m, found 0"):
        largest_piece(np.zeros((2, 3)), 0.0)
